"""Adds the library of loops to a wheel, where one can be made: then it is for one platform, with any Python."""

import subprocess
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

LIBRARY = Path("gpca/process/loops.so")


class WithLoops(build_py):
    """Adds the library to the modules."""

    def run(self) -> None:
        """Build."""
        super().run()
        if not subprocess.run([sys.executable, "-m", "gpca.process.build_loops"]).returncode:
            self.copy_file(str(LIBRARY), str(Path(self.build_lib, LIBRARY)))


class ForPlatform(bdist_wheel):
    """Names the platform, where the library is inside."""

    def get_tag(self) -> tuple[str, str, str]:
        """Return what the wheel is for: Python, its binary interface, and platform."""
        python, abi, platform = super().get_tag()
        with_loops = Path(self.get_finalized_command("build_py").build_lib, LIBRARY).is_file()
        return python, abi, self.plat_name.replace("-", "_") if with_loops else platform


setup(cmdclass={"build_py": WithLoops, "bdist_wheel": ForPlatform})
