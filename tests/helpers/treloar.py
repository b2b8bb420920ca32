"""Simple elongation of rubber vulcanised with 8 % sulphur, Treloar 1944 (doi:10.1039/TF9444000059), figure 3.

Values read from the figure as they are commonly given in the literature: stretch, and force over initial
area in kg/cm².
"""

from __future__ import annotations

import numpy as np

#: N/mm² in a kg/cm².
KILOGRAM_PER_CM2 = 0.0980665

STRETCH, FORCE = np.array(
    [
        (1.000, 0.00), (1.020, 0.26), (1.125, 1.37), (1.240, 2.30), (1.390, 3.23), (1.585, 4.16), (1.900, 5.10),
        (2.180, 6.00), (2.420, 6.90), (3.020, 8.80), (3.570, 10.7), (4.030, 12.5), (4.760, 16.2), (5.360, 19.9),
        (5.750, 23.6), (6.150, 27.4), (6.400, 31.0), (6.600, 34.8), (6.850, 38.5), (7.050, 42.1), (7.150, 45.8),
        (7.250, 49.6), (7.400, 53.3), (7.500, 57.0), (7.600, 64.4),
    ]
).T  # fmt: skip
STRESS = FORCE * KILOGRAM_PER_CM2
