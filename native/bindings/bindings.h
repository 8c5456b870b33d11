// The parts of the extension module, one source file each.
#pragma once

#include <nanobind/nanobind.h>

namespace vlp {

void bind_scene(nanobind::module_& m);
void bind_renderer(nanobind::module_& m);

}  // namespace vlp
