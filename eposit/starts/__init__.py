"""Start for planar objects from a homography on bearings, in NumPy, for many images at once."""
