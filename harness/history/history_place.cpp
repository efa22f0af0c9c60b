#include "harness/history/history_place.h"

#include <stdexcept>

#include "harness/history/history_branch.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {
namespace {

bool IsBranch(const HistoryPlace& place) {
  if (place.store.empty() == place.branch.empty()) {
    throw ConfigError("history: expected one of --store DIR and --branch NAME");
  }
  return !place.branch.empty();
}

OpenHistory OpenFolder(const HistoryPlace& place) {
  return {place.store, [](std::string message) { return message; }};
}

template <typename Work>
auto OnBranch(const HistoryBranch& branch, const Work& work) {
  try {
    return work(OpenHistory{branch.folder(), [&branch](std::string message) {
                              return branch.Named(std::move(message));
                            }});
  } catch (const ConfigError& error) {
    throw ConfigError(branch.Named(error.what()));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(branch.Named(error.what()));
  }
}

}  // namespace

void ReadPlace(const HistoryPlace& place, const std::function<void(const OpenHistory&)>& read) {
  if (IsBranch(place)) {
    OnBranch(HistoryBranch(place.branch), read);
  } else {
    read(OpenFolder(place));
  }
}

void ChangePlace(const HistoryPlace& place, bool may_begin,
                 const std::function<std::string(const OpenHistory&)>& change) {
  if (!IsBranch(place)) {
    change(OpenFolder(place));
    return;
  }
  for (bool is_kept = false; !is_kept;) {
    HistoryBranch branch(place.branch, may_begin);
    is_kept = branch.Commit(OnBranch(branch, change));
  }
}

}  // namespace loopbench::harness
