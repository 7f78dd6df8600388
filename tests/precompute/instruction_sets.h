// The instruction sets that precompute/ is compiled for.
#pragma once

#define HWY_WANT_AVX3_DL
#include "tests/support/instruction_sets.h"
