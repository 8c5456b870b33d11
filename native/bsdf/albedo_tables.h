// Fills the tables that bsdf/albedo.h reads (host only).
#pragma once

#include <vector>

namespace vlp {

// k_albedo_table_size floats, computed by quadrature at the first call, the same in every process.
const std::vector<float>& albedo_tables();

}  // namespace vlp
