"""Where the numbers of one problem lie in the workspace `w`, the one array that all compiled functions share.

A function's places are its arguments or the constants here; n is the number of points.
"""

PERSPECTIVE, STEREOGRAPHIC, EQUISOLID, ORTHOGONAL = 0.0, 1.0, 2.0, 3.0  # kinds of lens
POLYNOMIAL, PINHOLE_RADIAL, EUCM, DOUBLE_SPHERE = 4.0, 5.0, 6.0, 7.0  # kinds with coefficients
LENS = 0  # (8) kind, theta_max (rad), rho_max, least cosine of a pose's points, four coefficients
INTRINSICS = 8  # (4) fx, fy, cx, cy, px
CENTRE = 12  # (3) centroid of the object points
SIZE = 15  # their RMS distance from it
ANGULAR = 36  # 1 where residuals are angles: the image is stereographic, with f = 1, and its scale is divided out
KNOWN = 37  # minima found
REACH, THICKNESS, FLATNESS, SOLID = 16, 17, 18, 19  # what `describe` says
PLANE = 20  # (9) axes of the object's spread, rows of a rotation
CORNERS = 29  # (3) three points of large area
FLOOR = 32  # cost that is rounding
INFO_STEP = 33  # 3 where each point has its own weights, else 0
COST, STEPS = 34, 35  # second results of functions: the cost of a minimum; steps taken so far
GRADIENT, MOVE, GRADIENT_NEW = 40, 46, 52  # (6) each
PROPOSAL, TWIN = 60, 72  # (12) poses
HESSIAN, HESSIAN_NEW = 84, 120  # (6, 6) each
SCRATCH = 160  # (170)
STARTS, MOST_STARTS = 330, 12  # (12, 12) poses
MINIMA, MOST_MINIMA = 480, 8  # (8, 12) poses
COSTS = 576  # (8) their costs
FACTORS, FACTOR = 590, 42  # (9, 42) factors of their Hessians: L (6, 6), then d (6)
POINTS = 970  # (n, 3) points from their centroid over their size; then, n rows each:
PER_POINT = 26


# Places of the arrays after the points, in units of n: rays (n, 3), image over focal length (n, 2), weights (n, 3) as
# (xx, xy, yy), points in the plane (n, 2), EPOSIT's offsets (n, 3), their pseudo-inverse (3, n), pinhole points (n, 2).
RAYS, SEEN, INFO, FLAT, OFFSETS, SOLVER, IMAGE = 3, 6, 8, 11, 13, 16, 19
# For the search for wrong points: weights (n, 3) of points that are there, squared residuals (n), numbers to sort (n).
WEIGHTS, RESIDUALS, SORTED = 21, 24, 25

# Results of b images: blocks one after the other, each with a row of numbers for every image. A block begins at b times
# the place that it has for a single image, which is the constant here.
STATUS, ITERATIONS, RMSE, PRICE, AMBIGUOUS, UNRELIABLE = 0, 1, 2, 3, 4, 5  # price: the cost of the pose
POSE = 6  # (12) R row by row, then t, in the object's frame and unit
LINEAR_RESULT = 18  # numbers of a method that states no more
COVARIANCE = 18  # (6, 6)
OTHERS, ALTERNATIVES, OTHER = 54, 3, 13  # (3, 13) other minima, few problems have more: pose, then cost
RESULT = 93
