// Constants of packs of bodies, in their order. Equal ones are stored once, so that a mechanism of
// equal bodies of any length has them in the nearest cache.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <string_view>
#include <vector>

#include "mechanism/algebra/lanes.h"

namespace loopbench::odca {

template <template <class> class Link>
class PackKinds {
 public:
  void Add(const Link<Lanes>& pack) {
    const std::size_t hash = std::hash<std::string_view>()(Bytes(pack));
    const auto [first, last] = by_hash_.equal_range(hash);
    auto known = std::find_if(
        first, last, [&](const auto& other) { return Bytes(kinds_[other.second]) == Bytes(pack); });
    if (known == last) {
      known = by_hash_.emplace(hash, static_cast<int>(kinds_.size()));
      kinds_.push_back(pack);
    }
    kind_of_pack_.push_back(known->second);
  }
  int size() const { return static_cast<int>(kind_of_pack_.size()); }
  const Link<Lanes>& operator[](int pack) const { return kinds_[kind_of_pack_[pack]]; }

 private:
  static std::string_view Bytes(const Link<Lanes>& pack) {
    return {reinterpret_cast<const char*>(&pack), sizeof(pack)};
  }
  std::multimap<std::size_t, int> by_hash_;
  std::vector<Link<Lanes>> kinds_;
  std::vector<int> kind_of_pack_;
};

}  // namespace loopbench::odca
