"""Blender's importer on what `topple export --gltf --json` wrote: every body is there, moves through all frames, and stands where the
record has it. Called as `blender -b --python-exit-code 1 --python check_gltf_blender.py -- FOLDER`."""
import json
import pathlib
import sys

import bpy
import numpy

# Debian 12: the importer of its Blender (3.4) still asks for a name that its NumPy (1.24) has no more
if "bool" not in numpy.__dict__:
    numpy.bool = bool

folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
record = json.loads((folder / "record.json").read_text())
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=str(folder / "record.glb"))

scene = bpy.context.scene
rate = scene.render.fps / scene.render.fps_base
bodies = [(b, bpy.data.objects.get(body["name"])) for b, body in enumerate(record["bodies"]) if body["shapes"]]
missing = [record["bodies"][b]["name"] for b, found in bodies if found is None]
assert not missing, f"missing: {missing[:5]}"
print(f"{len(bodies)} of {len(record['bodies'])} bodies, {len(bpy.data.objects)} objects")

moving = [found for b, found in bodies if not record["bodies"][b]["fixed"]]
curves = [c for o in moving if o.animation_data and o.animation_data.action for c in o.animation_data.action.fcurves]
tracks = [t for o in moving if o.animation_data for t in o.animation_data.nla_tracks]
assert curves or tracks, "nothing moves"
time = record["time"]
last = max(c.keyframe_points[-1].co.x for c in curves)
assert abs(last - (time[-1] - time[0]) * rate) < 1e-2, f"the last key is at frame {last}, the record ends at {(time[-1] - time[0]) * rate}"
keys = max(len(c.keyframe_points) for c in curves)
assert keys == len(time), f"{keys} keys, {len(time)} frames of the record"

farthest, which = 0.0, ""
for k, t in enumerate(time):
    frame = (t - time[0]) * rate
    scene.frame_set(int(frame), subframe=frame - int(frame))
    for b, found in bodies:
        at = found.matrix_world.translation
        distance = sum((p - q) ** 2 for p, q in zip(at, record["position"][k][b])) ** 0.5
        if distance > farthest:
            farthest, which = distance, f"{record['bodies'][b]['name']} at {t:.3f} s"
# single precision of frame numbers, some 1e-6 s of times at up to some 20 m/s, and of places some 30 m from the origin
print(f"{keys} frames; farthest from the record: {1e3 * farthest:.4f} mm ({which})")
assert farthest < 1e-3, f"{which} lies {farthest} m off"
