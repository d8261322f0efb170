"""What is true of every pixel and of every point of the target: depth, range, normal, object, visibility."""
