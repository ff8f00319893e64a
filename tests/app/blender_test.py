# Opens an animated GLB of a run in Blender, which runs this: blender --background --python FILE -- RUN.glb
import sys

import bpy
import mathutils
import numpy

# The importer of Debian 12's Blender uses a name that Debian 12's numpy no longer has.
if "bool" not in numpy.__dict__:
    numpy.bool = bool


def check(holds, what):
    if not holds:
        print("FAULT:", what)
        sys.exit(1)


bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=sys.argv[-1])
objects = [o for o in bpy.data.objects if o.type == "MESH"]
frames = {int(o.name.split()[1]): o for o in objects if o.name.startswith("frame ")}
check(len(frames) == 13, "there are %d frames, not 13" % len(frames))
check(any(o.name.startswith("wall") for o in objects), "the wall is missing")
check(any(o.name.startswith("knife/blade") for o in objects), "the knife is missing")
names = {m.name for m in bpy.data.materials}
check({"block/surface", "block/cut"} <= names, "materials are missing: %s" % names)

scene = bpy.context.scene
per_second = scene.render.fps / scene.render.fps_base
knife = next(o for o in objects if o.name.startswith("knife/blade"))
heights = []
for k in range(13):
    at = (k + 0.5) * 0.02 * per_second  # frames of the run last 0.02 s
    scene.frame_set(int(at), subframe=at - int(at))
    seen = [n for n, o in frames.items() if max(map(abs, o.matrix_world.to_scale())) > 0.5]
    check(seen == [k], "at frame %d are seen %s" % (k, seen))
    heights.append((knife.matrix_world @ mathutils.Vector(knife.bound_box[0])).z)
check(heights[4] < heights[0] - 0.05, "the knife does not go down along z")

# The ball of the scene lies above the block, and z is up in Blender.
scene.frame_set(0)
points = [frames[0].matrix_world @ v.co for v in frames[0].data.vertices]
check(abs(max(p.z for p in points) - 0.23) < 0.01, "the scene does not stand upright")
print("SOUND")
