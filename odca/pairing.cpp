#include "odca/pairing.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <tuple>

namespace loopbench::odca {

namespace {

/// Boundaries up to this many bodies count as equal: boundaries of chains and ladders.
constexpr int kFew = 4;
/// Pairs of a part with more neighbours (a hub), and pairs with more joints, are looked at again
/// only when their turn comes.
constexpr std::size_t kMany = 16;

/// The class of a boundary is 0 up to kFew bodies and grows by one with each factor sqrt(2) beyond.
int BoundaryClass(int boundary) {
  if (boundary <= kFew) return 0;
  const auto area = static_cast<unsigned long>(boundary) * static_cast<unsigned long>(boundary);
  return static_cast<int>(std::bit_width((area - 1) / (kFew * kFew)));
}

}  // namespace

Pairing::Pairing(const BodyGraph& graph, std::span<const int> bodies, std::span<const int> names,
                 int dim, BodyMarks* marks)
    : num_bodies_(graph.num_bodies()), dim_(dim), marks_(*marks), parts_(names.size()) {
  for (std::size_t p = 0; p < names.size(); ++p) {
    parts_[p].name = names[p];
    parts_[p].first = std::numeric_limits<int>::max();
  }
  for (int body : bodies) {
    const int mine = marks_.part_of[body];
    int& open = marks_.open[body];
    open = graph.degree(body);
    marks_.closing[body] = 0;
    for (const BodyGraph::End& end : graph.ends(body)) {
      const int other = marks_.part_of[end.body];
      if (other == mine) --open;
      // each joint once, from its lower body: bonds are numbered in the order of bodies
      if (other < 0 || other == mine || end.body < body) continue;
      const auto [it, fresh] = parts_[mine].bonds.emplace(other, static_cast<int>(bonds_.size()));
      if (fresh) {
        parts_[other].bonds.emplace(mine, it->second);
        bonds_.push_back({mine, other, 0, {}});
      }
      Bond& bond = bonds_[it->second];
      bond.rows += end.rows;
      bond.joints.push_back({body, end.body});
    }
    Part& part = parts_[mine];
    part.first = std::min(part.first, body);
    ++part.bodies;
    part.boundary += open > 0;
  }
}

JoinSum Pairing::Run(std::vector<Join>* joins) {
  for (int bond = 0; bond < static_cast<int>(bonds_.size()); ++bond) queue_.push(KeyOf(bond));
  while (!queue_.empty()) {
    const Key key = queue_.top();
    queue_.pop();
    if (bonds_[key.bond].joints.empty()) continue;
    // joins made since then may have made this pair worse; for pairs of a hub only a change of
    // class counts, or each join would return all of them
    const Key now = KeyOf(key.bond);
    const auto neighbours = [&](int part) { return parts_[part].bonds.size(); };
    const Bond& bond = bonds_[key.bond];
    const bool hub = std::max(neighbours(bond.a), neighbours(bond.b)) > kMany;
    const bool worse_class =
        std::tie(now.boundary_class, now.size_class) > std::tie(key.boundary_class, key.size_class);
    if (worse_class || (now > key && !hub)) {
      queue_.push(now);
    } else {
      Merge(key.bond, joins);
    }
  }
  return sum_;
}

int Pairing::BoundaryAfter(const Bond& bond) {
  int boundary = parts_[bond.a].boundary + parts_[bond.b].boundary;
  sum_.looks += static_cast<long>(bond.joints.size());
  for (const auto& [a, b] : bond.joints) {
    for (int body : {a, b}) boundary -= ++marks_.closing[body] == marks_.open[body];
  }
  for (const auto& [a, b] : bond.joints) marks_.closing[a] = marks_.closing[b] = 0;
  return boundary;
}

Pairing::Key Pairing::KeyOf(int index) {
  const Bond& bond = bonds_[index];
  const int boundary = BoundaryAfter(bond);
  const auto bodies = static_cast<unsigned>(std::max(parts_[bond.a].bodies, parts_[bond.b].bodies));
  return {BoundaryClass(boundary), static_cast<int>(std::bit_width(bodies)), boundary, index};
}

void Pairing::Renew(int bond) {
  if (bonds_[bond].joints.size() <= kMany) queue_.push(KeyOf(bond));
}

void Pairing::Merge(int index, std::vector<Join>* joins) {
  Bond& bond = bonds_[index];
  const int after = BoundaryAfter(bond);
  int a = bond.a, b = bond.b;
  const int handles = parts_[a].boundary + parts_[b].boundary;
  sum_.cost += JoinCost(bond.rows, handles, after, dim_);
  sum_.handles = std::max(sum_.handles, handles);
  for (const auto& [from, to] : bond.joints) {
    --marks_.open[from];
    --marks_.open[to];
  }
  bond.joints.clear();
  bond.joints.shrink_to_fit();
  const bool in_order = parts_[a].first < parts_[b].first;
  joins->push_back({parts_[in_order ? a : b].name, parts_[in_order ? b : a].name});
  // the part with fewer bonds enters the other: each bond moves O(log n) times
  if (parts_[a].bonds.size() < parts_[b].bonds.size()) std::swap(a, b);
  Part& into = parts_[a];
  into.name = num_bodies_ + static_cast<int>(joins->size()) - 1;
  into.first = std::min(into.first, parts_[b].first);
  into.bodies += parts_[b].bodies;
  into.boundary = after;
  into.bonds.erase(b);
  parts_[b].bonds.erase(a);
  const std::map<int, int> moved = std::move(parts_[b].bonds);
  sum_.looks += static_cast<long>(moved.size());
  for (const auto& [other, old] : moved) {
    parts_[other].bonds.erase(b);
    Bond& from = bonds_[old];
    const auto [it, fresh] = into.bonds.emplace(other, old);
    if (fresh) {
      parts_[other].bonds.emplace(a, old);
      from.a = a;
      from.b = other;
    } else {
      Bond& to = bonds_[it->second];
      to.rows += from.rows;
      if (to.joints.size() < from.joints.size()) std::swap(to.joints, from.joints);
      to.joints.insert(to.joints.end(), from.joints.begin(), from.joints.end());
      from.joints.clear();
    }
    if (into.bonds.size() > kMany) Renew(it->second);
  }
  if (into.bonds.size() > kMany) return;
  for (const auto& [other, bond_there] : into.bonds) Renew(bond_there);
}

}  // namespace loopbench::odca
