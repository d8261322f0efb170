"""Whether image-to-pose got better or worse, by how much, with what certainty.

The way of a judgement, file by file: `measures` turns a dataset's tables into one row for each frame and system, with
the `metrics` as columns; `judgement` matches two such tables slice by slice; `comparison` decides about one metric in
one slice. A slice is a sensor regime, a camera and a system: a detector, or a solver with its setting.
"""
