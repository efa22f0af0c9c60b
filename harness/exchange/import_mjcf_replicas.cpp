// <replicate>: copies of elements, their names, and the elements that refer to them.
#include <fmt/format.h>

#include "harness/exchange/import_mjcf.h"

namespace loopbench::harness {

namespace {

constexpr std::size_t kMostCopies = 100000;  // of elements in replicas
constexpr std::size_t kMostNested = 16;

}  // namespace

void MjcfModel::CountCopy(const XmlElement& element) {
  if (++num_copies_ <= kMostCopies) return;
  element.Fail(fmt::format("more than {} elements of replicas", kMostCopies), "fewer");
}

const MjcfReplica* MjcfModel::AddReplica(const XmlElement& element, const MjcfReplica* around,
                                         const std::string& suffix) {
  draft->has_replicas = true;
  CountCopy(element);
  std::size_t depth = 1;
  for (const MjcfReplica* outer = around; outer != nullptr; outer = outer->around) ++depth;
  if (depth > kMostNested) {
    element.Fail(fmt::format("more than {} nested <replicate>", kMostNested), "fewer");
  }
  const auto [known, is_new] = known_.emplace(element.id(), replicates.size());
  if (is_new) {
    MjcfReplicate& added = replicates.emplace_back();
    if (around != nullptr) added.around = around->replicate;
  }
  const std::string outer = around != nullptr ? around->suffix : "";
  replicas_.push_back({known->second, around, suffix + outer});
  replicates[known->second].replicas.push_back(&replicas_.back());
  return &replicas_.back();
}

std::string MjcfModel::NewName(const std::string& kind, const XmlValue& name,
                               const MjcfReplica* replica) {
  if (replica == nullptr) return name.Name();
  replicated_.emplace(kind + " " + name.Name(), replica->replicate);
  return name.Name() + replica->suffix;
}

std::string MjcfModel::NameOf(const std::string& kind, const XmlValue& reference) const {
  const auto found = replicated_.find(kind + " " + reference.Name());
  const MjcfReplica* replica = found == replicated_.end() ? nullptr : present_;
  while (replica != nullptr && replica->replicate != found->second) replica = replica->around;
  return reference.Name() + (replica != nullptr ? replica->suffix : "");
}

void MjcfModel::ForReplicas(const References& references, const std::function<void()>& read) {
  const auto is_around = [&](std::size_t outer, std::optional<std::size_t> inner) {
    while (inner && *inner != outer) inner = replicates[*inner].around;
    return inner.has_value();
  };
  std::optional<std::size_t> innermost;
  for (const auto& [kind, name] : references) {
    const auto found = name ? replicated_.find(kind + " " + name->text()) : replicated_.end();
    if (found == replicated_.end() || is_around(found->second, innermost)) continue;
    if (innermost && !is_around(*innermost, found->second)) {
      name->Fail("names in one <replicate>, or in others around it");
    }
    innermost = found->second;
  }
  if (!innermost) return read();
  for (const MjcfReplica* replica : replicates[*innermost].replicas) {
    present_ = replica;
    CountCopy(references[0].second ? references[0].second->element() : draft->element(kGround));
    read();
  }
  present_ = nullptr;
}

}  // namespace loopbench::harness
