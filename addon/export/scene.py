"""An evaluated depsgraph to `vlp_bpt.Scene`: every geometry once, however often it is placed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from vlp_bpt.scene import Film, Float32, Instance, Mesh, Scene, Spheres, Visibility
from vlp_bpt.validation import is_singular

from .camera import export_camera
from .light import export_light
from .material import default_material, export_material
from .mesh import export_mesh
from .notes import ExportError, Notes
from .pointcloud import export_pointcloud
from .world import export_world

# Curves, surfaces, text and metaballs are shown through the mesh that they evaluate to, which is listed beside them.
GEOMETRY_TYPES = {"MESH", "POINTCLOUD"}
MISSING_TYPES = {"CURVES": "hair curves", "VOLUME": "volumes", "GREASEPENCIL": "grease pencil"}
OTHER_VISIBILITY = ("visible_diffuse", "visible_glossy", "visible_transmission", "visible_shadow")


def export_scene(
    depsgraph: bpy.types.Depsgraph,
    *,
    width: int | None = None,
    height: int | None = None,
    window: tuple[int, int, int, int] | None = None,
    notes: Notes | None = None,
) -> Scene:
    """Everything that the depsgraph's view layer shows in a render.

    width, height: the full resolution in pixels, the scene's own by default; window: the part of it to render.
    What had to be left out or simplified is added to `notes`. Raises ExportError where nothing can be rendered.
    """
    notes = Notes() if notes is None else notes
    scene = depsgraph.scene_eval
    render = scene.render
    width = render.resolution_x * render.resolution_percentage // 100 if width is None else width
    height = render.resolution_y * render.resolution_percentage // 100 if height is None else height
    if render.use_motion_blur:
        notes.warn(f"Scene '{scene.name}': motion blur is not there yet")
    exported = Scene(
        camera=export_camera(depsgraph, width, height, notes),
        film=Film(width, height, window, render.film_transparent),
        world=export_world(depsgraph.view_layer_eval.world_override or scene.world, notes),
    )
    _Objects(exported, notes, depsgraph).add_all()
    return exported


@dataclass(frozen=True)
class _Shown:
    """What all instances of one object with one geometry share."""

    name: str
    geometry: int  # index in the scene
    materials: tuple[int, ...]
    visibility: Visibility


class _Objects:
    """Adds the objects of a depsgraph to a scene, and remembers what was added for the instances to come."""

    def __init__(self, scene: Scene, notes: Notes, depsgraph: bpy.types.Depsgraph) -> None:
        self.scene = scene
        self.notes = notes
        self._depsgraph = depsgraph
        self._override = depsgraph.view_layer_eval.material_override
        self._geometries: dict[tuple[str, int], int | None] = {}  # by type and pointer of evaluated data; None: empty
        self._materials: dict[int, int] = {}  # by pointer of an evaluated material, 0 for none
        self._shown: dict[tuple[int, int], _Shown | None] = {}  # by pointers of the original object and its data

    def add_all(self) -> None:
        """Adds every object and instance. None of them is kept: they die as the iteration goes on."""
        transforms = instance_transforms(self._depsgraph)
        # What is not a number is left in: an error that the scene's own check names.
        singular = is_singular(transforms) & np.isfinite(transforms).all(axis=(1, 2))
        for index, instance in enumerate(self._depsgraph.object_instances):
            if not instance.show_self:
                continue
            shown = instance.object
            hidden = instance.is_instance and not instance.parent.visible_camera
            if shown.type in GEOMETRY_TYPES:
                self._add_geometry(shown, transforms[index], bool(singular[index]), hidden)
            elif shown.type == "LIGHT":
                self._add_light(shown, transforms[index], hidden)
            elif shown.type in MISSING_TYPES:
                self.notes.warn(f"Object '{shown.name}': {MISSING_TYPES[shown.type]} are not there yet, left out")

    def _add_light(self, lamp: Any, matrix: Float32, hidden: bool) -> None:
        visibility = Visibility(0) if hidden else self._visibility(lamp)
        self._report_missing(lamp)
        light = export_light(lamp, matrix, visibility, self.notes)
        if light is not None:
            self.scene.lights.append(light)

    def _add_geometry(self, shown: Any, matrix: Float32, singular: bool, hidden: bool) -> None:
        # Objects that Blender makes for instances of geometry nodes share a pointer in turn: their original does not.
        key = (shown.original.as_pointer(), shown.data.as_pointer())
        if key not in self._shown:
            self._shown[key] = self._describe(shown)
        common = self._shown[key]
        if common is None:
            return
        if singular:
            scale = ", ".join(f"{length:.6g}" for length in np.linalg.norm(matrix[:, :3].astype(float), axis=0))
            self.notes.warn(f"Object '{common.name}': with a scale of ({scale}) it cannot be rendered, left out")
            return
        visibility = Visibility(0) if hidden else common.visibility
        self.scene.instances.append(Instance(common.name, common.geometry, matrix, common.materials, visibility))

    def _describe(self, shown: Any) -> _Shown | None:
        geometry = self._geometry(shown)
        if geometry is None:
            return None
        self._report_missing(shown)
        return _Shown(shown.name, geometry, self._material_slots(shown), self._visibility(shown))

    def _visibility(self, shown: Any) -> Visibility:
        indirect_only = shown.original.indirect_only_get(view_layer=self._depsgraph.view_layer)
        return Visibility.CAMERA if shown.visible_camera and not indirect_only else Visibility(0)

    def _report_missing(self, shown: Any) -> None:
        """Reports what an object asks for and is not there yet."""
        linking = shown.light_linking
        missing = {
            "light linking": linking.receiver_collection is not None or linking.blocker_collection is not None,
            "ray visibility other than to the camera": not all(getattr(shown, name) for name in OTHER_VISIBILITY),
        }
        if shown.type != "LIGHT":  # where these mean nothing, and a new one is a shadow catcher
            missing |= {
                "holdout": shown.original.holdout_get(view_layer=self._depsgraph.view_layer),
                "particle hair": any(system.settings.render_type == "PATH" for system in shown.particle_systems),
                "shadow catcher": shown.is_shadow_catcher,
            }
        for what, asked in missing.items():
            if asked:
                self.notes.warn(f"Object '{shown.name}': {what} is not there yet")

    def _geometry(self, shown: Any) -> int | None:
        """The index of an object's geometry in the scene, exported at the first sight of it."""
        key = (shown.type, shown.data.as_pointer())
        if key not in self._geometries:
            geometry = _exported(shown)
            self._geometries[key] = None if geometry is None else len(self.scene.geometries)
            if geometry is not None:
                self.scene.geometries.append(geometry)
        return self._geometries[key]

    def _material_slots(self, shown: Any) -> tuple[int, ...]:
        """A scene material for each slot: the view layer's, or linked to the object or to its data, at least one."""
        if self._override is not None:
            return (self._material(self._override),)
        materials = list(shown.data.materials)
        for index, slot in enumerate(shown.material_slots):
            if slot.link == "OBJECT" or index >= len(materials):
                materials[index : index + 1] = [slot.material]
        return tuple(self._material(material) for material in materials or [None])

    def _material(self, material: Any) -> int:
        key = 0 if material is None else material.as_pointer()
        if key not in self._materials:
            self._materials[key] = len(self.scene.materials)
            exported = default_material() if material is None else export_material(material, self.notes)
            self.scene.materials.append(exported)
        return self._materials[key]


def _exported(shown: Any) -> Mesh | Spheres | None:
    if shown.type == "POINTCLOUD":
        return export_pointcloud(shown.data, shown.name)
    # Through to_mesh: an object in edit mode keeps its vertices elsewhere. It costs nothing otherwise.
    mesh = shown.to_mesh()
    try:
        return None if mesh is None else export_mesh(mesh, shown.name)
    finally:
        shown.to_mesh_clear()


def instance_transforms(depsgraph: bpy.types.Depsgraph) -> Float32:
    """(I, 3, 4) object-to-world transforms in the order of `object_instances`: Blender stores their columns."""
    matrices = np.empty(len(depsgraph.object_instances) * 16, np.float32)
    depsgraph.object_instances.foreach_get("matrix_world", matrices)
    return np.ascontiguousarray(matrices.reshape(-1, 4, 4).transpose(0, 2, 1)[:, :3])


__all__ = ["ExportError", "Notes", "export_scene"]
