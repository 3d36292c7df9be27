import numpy as np

from gpca.frames.shots import Sighting


def test_pixels_are_found_wherever_they_are_and_no_others():
    seen = Sighting(np.zeros((1, 3)), np.array([[3, 4], [0, 0], [639, 479]], np.int32), np.eye(3))
    asked = np.array([[3, 4], [4, 3], [0, 0], [-1, 479], [639, 479], [638, 2**20]])
    assert seen.measured(asked).tolist() == [True, False, True, False, True, False]
