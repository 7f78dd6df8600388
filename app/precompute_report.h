// What a precomputation tells the user, whichever command ran it.
#pragma once

#include "app/session.h"
#include "precompute/precompute.h"

namespace freevoxel {

/// Into statistics and warnings.
void reportPrecompute(const PrecomputeResult& result, Session& session);

}  // namespace freevoxel
