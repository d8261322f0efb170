"""Speed and memory, measured: every figure is a ratio of two things timed alternately in one run."""
