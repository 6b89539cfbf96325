"""The area and the reference layout of the Marco Polo game, and shapes that several tests use."""

import numpy as np

from agents.pursuit.law import Area

AREA = Area((0.0, 10.0), (0.0, 10.0))
CENTRES = np.array([(2.5, 2.5), (7.5, 7.5), (2.5, 7.5), (7.5, 2.5), (5.0, 5.0), (5.0, 1.5), (5.0, 8.5)])
RADII = np.array([1.5, 1.5, 1.0, 1.0, 1.0, 1.25, 1.25])
OBSTACLE = ((3.0, 3.0), (7.0, 3.0), (7.0, 7.0), (3.0, 7.0))
ZONE = ((7.5, 2.0), (9.5, 2.0), (9.5, 6.0), (7.5, 6.0))
