"""The hybrid renderer: light by Mitsuba, edges in closed form.

What light falls on the target is baked once for a scene, a shiny layer is traced with few rays for each frame, and the
target's edges are those of `render.analytic`. What stands around the target and in front of it is path-traced.
"""
