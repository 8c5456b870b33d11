"""The Cornell box from its published data, one millimetre of the data being one millimetre here."""

from __future__ import annotations

import builder
import spectra

WALLS = {
    "floor": [(552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2)],
    "ceiling": [(556, 548.8, 0), (556, 548.8, 559.2), (0, 548.8, 559.2), (0, 548.8, 0)],
    "back wall": [(549.6, 0, 559.2), (0, 0, 559.2), (0, 548.8, 559.2), (556, 548.8, 559.2)],
    "right wall": [(0, 0, 559.2), (0, 0, 0), (0, 548.8, 0), (0, 548.8, 559.2)],
    "left wall": [(552.8, 0, 0), (549.6, 0, 559.2), (556, 548.8, 559.2), (556, 548.8, 0)],
}
BLOCKS = {  # the corners of the top; the sides go straight down to the floor
    "short block": [(130, 165, 65), (82, 165, 225), (240, 165, 272), (290, 165, 114)],
    "tall block": [(423, 330, 247), (265, 330, 296), (314, 330, 456), (472, 330, 406)],
}
LIGHT_X, LIGHT_Z, CEILING = (213.0, 343.0), (227.0, 332.0), 548.8
LIGHT_GAP = 0.5  # mm below the ceiling: the published patch replaces a piece of it, a lamp needs room to shine
CAMERA, FOCAL_LENGTH, FILM = (278.0, 273.0, -800.0), 35.0, 25.0
CENTER_X = 278.0


def place(p: builder.Point) -> tuple[float, float, float]:
    """The data's millimetres (x to the left, y up, z away) as Blender's metres (x right, y away, z up)."""
    return (CENTER_X - p[0]) / 1000, p[2] / 1000, p[1] / 1000


def add_room(scene: builder.bpy.types.Scene) -> None:
    """Walls, lamp and camera."""
    white = builder.diffuse("white", spectra.reflectance_rgb(spectra.WHITE))
    green = builder.diffuse("green", spectra.reflectance_rgb(spectra.GREEN))
    red = builder.diffuse("red", spectra.reflectance_rgb(spectra.RED))
    for name, corners in WALLS.items():
        material = {"left wall": red, "right wall": green}.get(name, white)
        builder.mesh(name, map(place, corners), [(0, 1, 2, 3)], material)
    center = (sum(LIGHT_X) / 2, CEILING - LIGHT_GAP, sum(LIGHT_Z) / 2)
    size = ((LIGHT_X[1] - LIGHT_X[0]) / 1000, (LIGHT_Z[1] - LIGHT_Z[0]) / 1000)
    below = (center[0], 0.0, center[2])
    builder.area_lamp("light", spectra.light_rgb(), size, place(center), place(below))
    ahead = (CAMERA[0], CAMERA[1], 0.0)
    builder.camera(scene, place(CAMERA), place(ahead), FOCAL_LENGTH, FILM, clip_start=0.01)


def main() -> None:
    scene = builder.new_file("cornell_box", 512, 512)
    add_room(scene)
    white = builder.bpy.data.materials["white"]
    for name, top in BLOCKS.items():
        bottom = [(x, 0.0, z) for x, _, z in top]
        sides = [(4 + i, 4 + (i + 1) % 4, (i + 1) % 4, i) for i in range(4)]
        builder.mesh(name, map(place, [*top, *bottom]), [(0, 1, 2, 3), *sides], white)
    builder.save(scene, "cornell_box")


if __name__ == "__main__":
    main()
