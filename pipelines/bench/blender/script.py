"""The board in Blender's Cycles, rendered on request; runs under a Python that has `bpy`, and imports nothing of ours.

`python script.py SCENE.json` builds the scene that the file describes (see pipelines/bench/blender/scene.py) and
answers lines of JSON on stdout: its version, then the seconds of every request that comes on stdin, one a line:
{"region": [x, y, width, height] in pixels from the upper left, or null for the whole picture; "save": an EXR or null}.
"""

import json
import os
import sys
import time
from collections.abc import Callable, Iterable
from typing import Any

Description = dict[str, Any]
NO_BPY = 3  # exit code
INSIDE = 0.25  # px: Blender rounds borders down

try:
    import bpy  # pyright: ignore[reportMissingImports]
    from mathutils import Matrix  # pyright: ignore[reportMissingImports]
except ImportError:
    sys.exit(NO_BPY)


def build(scene: Description) -> None:
    """The scene of a description in an empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    here = bpy.context.scene
    board, disc = scene["board"], scene["disc"]
    add_mesh("board", board["corners"], textured(board["reflectance"]), board["uv"])
    add_mesh("disc", disc["rim"], diffuse(disc["reflectance"]))
    add_lamp(scene["lamp"])
    here.world = bpy.data.worlds.new("surrounding")
    here.world.use_nodes = True
    colour(here.world.node_tree.nodes["Background"], scene["surrounding"])
    add_camera(here, scene["camera"])
    settle(here, scene["samples"], scene["threads"])


def add_mesh(name: str, corners: list[list[float]], material: Any, uv: list[list[float]] | None = None) -> None:
    """One polygon."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [list(range(len(corners)))])
    mesh.materials.append(material)
    if uv is not None:
        layer = mesh.uv_layers.new()
        for loop, place in zip(layer.data, uv, strict=True):
            loop.uv = place
    link(name, mesh)


def link(name: str, data: Any) -> Any:
    """An object that holds the data, in the scene."""
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def diffuse(reflectance: float) -> Any:
    """A matt material."""
    material = bpy.data.materials.new("matt")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    surface, out = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    surface.inputs["Color"].default_value = (reflectance, reflectance, reflectance, 1.0)
    material.node_tree.links.new(surface.outputs[0], out.inputs["Surface"])
    return material


def textured(rows: list[list[float]]) -> Any:
    """A matt material with one texel for a square, rows from v = 0."""
    material = diffuse(1.0)
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    image = bpy.data.images.new("squares", len(rows[0]), len(rows), float_buffer=True, is_data=True)
    image.pixels = [value for row in rows for grey in row for value in (grey, grey, grey, 1.0)]
    texture.image, texture.interpolation, texture.extension = image, "Closest", "EXTEND"
    surface = next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    tree.links.new(texture.outputs["Color"], surface.inputs["Color"])
    return material


def add_lamp(lamp: Description) -> None:
    """A square lamp."""
    light = bpy.data.lights.new("lamp", "AREA")
    light.shape, light.size, light.energy = "SQUARE", lamp["side"], lamp["watts"]
    thing = link("lamp", light)
    thing.matrix_world = Matrix(lamp["to_world"])
    thing.visible_camera = False


def colour(background: Any, radiance: float) -> None:
    """An even surrounding."""
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    background.inputs["Strength"].default_value = radiance


def add_camera(here: Any, camera: Description) -> None:
    """The fish-eye and its picture."""
    data = bpy.data.cameras.new("camera")
    data.type = "PANO"
    lens = data if hasattr(data, "panorama_type") else data.cycles  # before Blender 5
    lens.panorama_type = "FISHEYE_EQUISOLID"
    lens.fisheye_lens, lens.fisheye_fov = camera["lens_mm"], camera["field"]
    data.sensor_fit, data.sensor_width = "HORIZONTAL", camera["sensor_width_mm"]
    data.shift_x, data.shift_y = camera["shift"]
    data.clip_start, data.clip_end = 1e-3, 1e4
    here.camera = link("camera", data)
    here.camera.matrix_world = Matrix(camera["to_world"])
    render = here.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = *camera["size"], 100
    render.pixel_aspect_x, render.pixel_aspect_y = camera["pixel_aspect"]


def settle(here: Any, samples: int, threads: int) -> None:
    """Cycles on the processor: direct light, all samples for every pixel, no denoiser, data kept between renders."""
    render, cycles = here.render, here.cycles
    render.engine = "CYCLES"
    render.threads_mode, render.threads = "FIXED", threads
    render.use_persistent_data = True
    render.film_transparent = True
    render.use_compositing = render.use_sequencer = False
    render.image_settings.file_format, render.image_settings.color_mode = "OPEN_EXR", "RGBA"
    render.image_settings.color_depth = "32"
    cycles.device, cycles.samples, cycles.max_bounces = "CPU", samples, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_light_tree = False
    cycles.pixel_filter_type = "BOX"


def choose(here: Any, region: list[int] | None) -> None:
    """Render the whole picture or a region of it only."""
    render = here.render
    render.use_border = render.use_crop_to_border = region is not None
    if region is not None:
        x, y, width, height = region
        across, down = render.resolution_x, render.resolution_y
        bottom = down - y - height
        render.border_min_x, render.border_max_x = (x + INSIDE) / across, (x + width + INSIDE) / across
        render.border_min_y, render.border_max_y = (bottom + INSIDE) / down, (bottom + height + INSIDE) / down


def serve(requests: Iterable[str], answer: Callable[[Description], None]) -> None:
    """Render what is asked for; only the call of the renderer is timed."""
    here = bpy.context.scene
    for line in requests:
        request = json.loads(line)
        choose(here, request["region"])
        wall, cpu = time.perf_counter(), time.process_time()
        bpy.ops.render.render()
        answer({"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu})
        if request["save"]:
            bpy.data.images["Render Result"].save_render(request["save"])
            answer({"saved": request["save"]})


def main() -> None:
    """Blender's own words go to stderr, so that stdout holds nothing but answers."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)

    def answer(value: Description) -> None:
        print(json.dumps(value), file=out, flush=True)

    with open(sys.argv[1], encoding="utf-8") as file:
        build(json.load(file))
    answer({"blender": bpy.app.version_string})
    serve(sys.stdin, answer)


if __name__ == "__main__":
    main()
