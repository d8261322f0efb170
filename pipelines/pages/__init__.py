"""What every page of ours is made of: one look, one script, one way to show numbers, tables, figures and frames.

A page is one file. It loads nothing and runs nothing but its own script, which a content security policy pins by hash.

File by file: `template` fills a page's own template, which extends `layout.html` and takes parts from `pieces.html`;
`page.css` and `page.js` go into each page; `numbers` are digits that mean something, `sections` tables and figures as
data, `svg` figures drawn by Matplotlib, `frames` and `pictures` frames of a dataset with what was found in them.
"""
