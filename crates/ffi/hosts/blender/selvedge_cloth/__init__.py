"""Woven cloth in Blender: File > Import > Woven cloth makes a material of a weaver's draft or a fabric.

The program `selvedge` bakes maps of the cloth, which a Principled BSDF reads: it is looked for where the preferences of
the add-on say, then where SELVEDGE_PROGRAM says, then in PATH.
"""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from . import material
from .baking import Baked, BakeError, bake, folder_for


class Preferences(bpy.types.AddonPreferences):
    """Where the program is."""

    bl_idname = __package__

    program: StringProperty(
        name="Program",
        description="The program selvedge; if empty, SELVEDGE_PROGRAM or what is found in PATH",
        subtype="FILE_PATH",
    )

    def draw(self, _context):
        self.layout.prop(self, "program")


class WovenCloth(bpy.types.Operator, ImportHelper):
    """Makes a material of a weaver's draft (WIF) or a fabric (JSON) and gives it to the active object"""

    bl_idname = "material.woven_cloth"
    bl_label = "Woven cloth"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".wif"
    filter_glob: StringProperty(default="*.wif;*.json", options={"HIDDEN"})
    size: IntProperty(
        name="Pixels", description="Width and height of each map", default=1024, min=16, max=8192
    )
    repeats: IntProperty(
        name="Repeats", description="Repeats of the draft in a map, along weft and warp", default=1, min=1, max=1000
    )
    uv_size: FloatProperty(
        name="UV size",
        description="Length on the object that 1 of its UV map spans: it gives the threads their real size",
        subtype="DISTANCE",
        default=1.0,
        min=1e-4,
        soft_max=100.0,
    )
    pack: BoolProperty(
        name="Pack images",
        description="Keep the maps in the .blend; else they lie beside it, by relative paths. A file that has not been "
        "saved has them packed",
        default=False,
    )

    def execute(self, context):
        addon = context.preferences.addons.get(__package__)
        program = addon.preferences.program if addon else ""
        cloth = bpy.path.abspath(self.filepath)
        is_packed = self.pack or not bpy.data.is_saved
        try:
            with folder_for(cloth, is_packed) as folder:
                baked = bake(bpy.path.abspath(program), cloth, folder, self.size, self.repeats)
                made = material.build(baked, self.uv_size, is_packed)
        except BakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        subject = context.object
        if subject is not None and hasattr(subject.data, "materials"):
            if subject.data.materials:
                subject.data.materials[subject.active_material_index] = made
            else:
                subject.data.materials.append(made)
        self.report({"INFO"}, f"{made.name}: one tile is {_millimetres(baked)}")
        return {"FINISHED"}


def _millimetres(baked: Baked) -> str:
    return " x ".join(f"{1e3 * side:.2f}" for side in baked.size) + " mm"


def _menu(self, _context):
    self.layout.operator(WovenCloth.bl_idname, text="Woven cloth (.wif, .json)")


CLASSES = (Preferences, WovenCloth)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.TOPBAR_MT_file_import.append(_menu)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(_menu)
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
