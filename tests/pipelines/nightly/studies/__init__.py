"""Studies of the nightly gates: planted faults and quiet nights in numbers, written into `docs/evidence`.

`pool` measures real noise draws, `reading` makes a night's measures of them, `faults` plants, `simulated_nights` judges
with the product's gates, `real_nights` runs whole nights on real pictures, `evidence` writes the pages.
"""
