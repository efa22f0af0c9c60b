// Butcher tables of the installed ARKODE.
#include <arkode/arkode_arkstep.h>

#include <span>
#include <stdexcept>

#include "harness/config/options.h"

namespace loopbench::harness {

// Names in the headers of ARKODE, null at the end; the build writes them (harness/CMakeLists.txt).
// Version 6.4 has no function for them.
extern const char* const kErkTables[];
extern const char* const kDirkTables[];

namespace {

ButcherTable Copy(const char* name, ARKodeButcherTable table) {
  if (table == nullptr) {
    throw std::runtime_error(std::string(name) + ": in ARKODE's headers, not in its library");
  }
  const auto size = static_cast<std::size_t>(table->stages);
  const auto list = [size](const sunrealtype* values) {
    return std::vector<double>(values, values + size);
  };
  ButcherTable copy{.name = name, .b = list(table->b), .c = list(table->c), .order = table->q};
  for (const sunrealtype* row : std::span(table->A, size)) copy.A.push_back(list(row));
  if (table->d != nullptr && table->p > 0) {
    copy.b_embedded = list(table->d);
    copy.embedded_order = table->p;
  }
  ARKodeButcherTable_Free(table);
  return copy;
}

}  // namespace

std::vector<ButcherTable> ArkodeTables() {
  std::vector<ButcherTable> tables;
  for (const char* const* name = kErkTables; *name != nullptr; ++name) {
    tables.push_back(Copy(*name, ARKodeButcherTable_LoadERKByName(*name)));
  }
  for (const char* const* name = kDirkTables; *name != nullptr; ++name) {
    tables.push_back(Copy(*name, ARKodeButcherTable_LoadDIRKByName(*name)));
  }
  return tables;
}

}  // namespace loopbench::harness
