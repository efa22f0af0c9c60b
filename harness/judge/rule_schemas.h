// Schemas of files of rules, printed by harness/json/schema.h.
#pragma once

#include "harness/json/schema.h"

namespace loopbench::harness {

Json ClaimsSchema();
Json MapSchema();

}  // namespace loopbench::harness
