"""The page of a night, `report.html`: one file from the history alone, with pictures of frames if they are given.

File by file: `findings` are tonight's comparisons in the order and the words of the page, `series` the same ones over
the nights, `plots` and `pictures` their drawings, and `write` puts them into the template.
"""
