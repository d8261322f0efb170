"""The tables that every run writes: all but `bounds`, which has a command of its own."""

from datasets.schema import TABLES

OF_A_RUN = {name: schema for name, schema in TABLES.items() if name != "bounds"}
