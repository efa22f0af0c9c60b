// Schemas of files of rules, printed by harness/base/schema.h.
#pragma once

#include "harness/base/schema.h"

namespace loopbench::harness {

Json ClaimsSchema();
Json MapSchema();

}  // namespace loopbench::harness
