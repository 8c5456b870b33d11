// Fills the tables that film/filter.h reads (host only).
#pragma once

#include <vector>

#include "film/filter.h"

namespace vlp {

// The share of a bell-shaped filter that lies beyond `distance` (in widths, >= 0) on one side of the centre.
double filter_share_beyond(Filter filter, double distance);

// Those of the Gaussian and the Blackman-Harris filter, k_filter_table_size floats each, the same in every process.
const std::vector<float>& filter_tables();

}  // namespace vlp
