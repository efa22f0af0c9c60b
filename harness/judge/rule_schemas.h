// The schemas of files of rules, as harness/json/schema.h prints them.
#pragma once

#include "harness/json/schema.h"

namespace loopbench::harness {

Json ClaimsSchema();
Json MapSchema();

}  // namespace loopbench::harness
