"""Runs in Blender's Python: open a stage, say where joints and vertices stand.

Usage: python blender_joints.py STAGE OUT.json FRAME...
"""

import json
import sys
from pathlib import Path

import bpy


def upright(vector):
    """Blender is Z up and looks along -Y; a stage is Y up and looks along +Z."""
    return [vector[0], vector[2], -vector[1]]


stage, out, *frames = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
status = bpy.ops.wm.usd_import(filepath=stage)
scene = bpy.context.scene
(armature,) = (thing for thing in bpy.data.objects if thing.type == "ARMATURE")
(body,) = (thing for thing in bpy.data.objects if thing.type == "MESH")

joints, vertices = {}, {}
for frame in map(int, frames):
    scene.frame_set(frame)
    graph = bpy.context.evaluated_depsgraph_get()
    posed, skinned = armature.evaluated_get(graph), body.evaluated_get(graph)
    joints[frame] = {bone.name: upright(posed.matrix_world @ bone.head) for bone in posed.pose.bones}
    vertices[frame] = [upright(skinned.matrix_world @ vertex.co) for vertex in skinned.data.vertices]

Path(out).write_text(
    json.dumps(
        {
            "status": list(status),
            "blender": bpy.app.version_string,
            "frame_start": scene.frame_start,
            "frame_end": scene.frame_end,
            "fps": scene.render.fps / scene.render.fps_base,
            "parents": {bone.name: bone.parent.name if bone.parent else None for bone in armature.data.bones},
            "scale": list(armature.matrix_world.to_scale()),
            "materials": {
                slot.material.name: list(
                    slot.material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value
                )[:3]
                for slot in body.material_slots
            },
            "side_of_polygon": [body.material_slots[face.material_index].material.name for face in body.data.polygons],
            "joints": joints,
            "vertices": vertices,
        }
    ),
    encoding="utf-8",
)
