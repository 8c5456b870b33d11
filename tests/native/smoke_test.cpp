// Placeholder: proves that the native tests build and run; the core's own tests replace it.
#include <gtest/gtest.h>

namespace vlp {
int cuda_device_count();
}

TEST(Smoke, CoreIsLinked) { EXPECT_GE(vlp::cuda_device_count(), 0); }
