"""The gates of a night, one file each, in the order in which they run; each ends in an `Outcome`.

ran, data, regenerate, replay: is there something to judge, and is it what it was? accuracy, failures, tail: the pinned
suite against the frozen baseline. fresh: views that nobody has seen before. speed: processor time.
"""
