"""The plan: every frame of a recipe with its pose, camera and seeds, before anything is rendered.

A frame is made from the recipe and its number when it is asked for, so that a plan of any length takes the same memory
in every process. Where cameras have a `max_field_deg`, a number of each pose is held, too (`datasets.plan.layout`).
"""

from datasets.plan.frame import Frame as Frame
from datasets.plan.frame import Stream as Stream
from datasets.plan.frame import rng_for as rng_for
from datasets.plan.frames import Plan as Plan
from datasets.plan.frames import frame_count as frame_count
from datasets.plan.frames import plan as plan
from datasets.plan.shards import frame_ids_of_shard as frame_ids_of_shard
from datasets.plan.shards import frames_of_shard as frames_of_shard
from datasets.plan.shards import shard_count as shard_count
from datasets.plan.shards import shard_frames as shard_frames
