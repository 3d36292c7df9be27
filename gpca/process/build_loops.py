"""Make the library of :mod:`gpca.process.compilation`: ``python -m gpca.process.build_loops``, half a minute.

Every loop that stands with its types is compiled by numba for the common level of processors. The optimized LLVM IR
that numba would run becomes position-independent code, which a C compiler links. Every build has the same bytes.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from gpca.process.compilation import LIBRARY, MODULES, Loop, library, numba, state
from gpca.process.processor import COMMON_LEVEL, pin_instructions

# Where a loop makes an array, numba's machine code reads the count of references and the data of this.
RUNTIME = """
#include <stdint.h>
#include <stdlib.h>
typedef struct { size_t count; void *destructor, *info, *data; size_t size; void *allocator; } Memory;
void *NRT_MemInfo_alloc_aligned(size_t size, unsigned align) {
    Memory *memory = malloc(sizeof(Memory) + size + align);
    if (!memory) return 0;
    uintptr_t data = (uintptr_t)(memory + 1) + align - 1;
    *memory = (Memory){1, 0, 0, (void *)(data - data % align), size, 0};
    return memory;
}
void NRT_MemInfo_call_dtor(void *memory) { free(memory); }
"""


def build(loops: list[Loop], path: Path, compiler: str) -> None:
    """Write the library of loops."""
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    machine = target.create_target_machine(cpu=COMMON_LEVEL, opt=3, reloc="pic", codemodel="default")
    code = llvm.parse_assembly("")
    code.triple = machine.triple
    for loop in loops:
        dispatcher = numba().njit(**loop.options | {"cache": False, "parallel": False})(loop.py_func)
        types = _types(iter(loop.ahead.split()))
        dispatcher.compile(types)
        compiled = dispatcher.overloads[types]
        module = llvm.parse_assembly(compiled.library.get_llvm_str())
        for part in (*module.functions, *module.global_variables):
            if part.name == compiled.fndesc.llvm_func_name:
                part.name = loop.symbol
            elif not part.is_declaration:
                part.linkage = "internal"
        code.link_in(module)
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(code, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=0)))
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        made, runtime, linked = (Path(folder, name) for name in ("loops.o", "runtime.c", "loops.so"))
        made.write_bytes(machine.emit_object(code))
        runtime.write_text(f'{RUNTIME}const char *state = "{state()}";\n', encoding="utf-8")
        options = ("-shared", "-fPIC", "-O2", "-s", "-Wl,-z,defs", "-Wl,--build-id=none", "-o", linked)
        subprocess.run([compiler, *options, runtime, made, "-lm"], check=True)
        linked.replace(path)


def _types(words: Iterator[str]) -> tuple[Any, ...]:
    """Return numba's types of what :func:`gpca.process.compilation.njit` is given, up to a closing parenthesis."""
    import numpy as np
    from numba import from_dtype, types

    all_types: list[Any] = []
    for word in words:
        if word == ")":
            break
        if word == "(":
            all_types.append(types.Tuple(_types(words)))
        else:
            scalar = from_dtype(np.dtype(word[0]))
            all_types.append(types.Array(scalar, int(word[1:]), "C") if word[1:] else scalar)
    return tuple(all_types)


def main() -> int:
    """Write the library where it is missing or of other sources; 1 after a line that says why there can be none."""
    compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if pin_instructions() != COMMON_LEVEL:
        fault = f"this processor, or GPCA_INSTRUCTIONS, is not for {COMMON_LEVEL}"
    elif library():
        return 0
    elif compiler is None:
        fault = "there is no C compiler, such as gcc"
    else:
        print(f"compiling loops into {LIBRARY}, which takes up to half a minute", flush=True)
        modules = map(import_module, MODULES)
        loops = [loop for module in modules for loop in vars(module).values() if isinstance(loop, Loop) and loop.ahead]
        try:
            with tempfile.TemporaryDirectory() as folder:
                os.environ["NUMBA_CACHE_DIR"] = folder  # all is compiled anew
                build(loops, LIBRARY, compiler)
            return 0
        except (ImportError, OSError, subprocess.CalledProcessError) as error:
            fault = str(error)
    print(f"no loops are compiled ahead of their first call: {fault}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
