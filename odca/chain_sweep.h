// Sweeps along chains of bodies: what paths in the plane (path_sweep.cpp) and arms in space
// (arm_sweep.cpp) have in common.
//
// The first bodies of a chain are in pieces of equal length; the last ones are single. kLanes
// pieces are a group, side by side. Pieces and single bodies are the nodes of a chain.
//
//   up     the bodies of each piece are joined one after another, pieces of a group side by side;
//          then the nodes of each chain, one after another
//   down   the same the other way round
//
// Threads share groups. Results depend on the mechanism alone, never on the number of threads. The
// depth is one piece plus the nodes of a chain: total work has priority over depth.
//
// Names of the lists: a pack holds body i of all pieces of a group. Places of bodies begin with
// packs, lane by lane; single bodies follow.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "odca/handles.h"

namespace loopbench::odca {

/// Constants of packs of bodies, in their order. Equal ones are stored once, so that a mechanism of
/// equal bodies of any length has them in the nearest cache.
template <class Pack>
class PackKinds {
 public:
  void Add(const Pack& pack) {
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
  const Pack& operator[](int pack) const { return kinds_[kind_of_pack_[pack]]; }

 private:
  static std::string_view Bytes(const Pack& pack) {
    return {reinterpret_cast<const char*>(&pack), sizeof(pack)};
  }
  std::multimap<std::size_t, int> by_hash_;
  std::vector<Pack> kinds_;
  std::vector<int> kind_of_pack_;
};

/// Nodes of a chain in the lists.
struct ChainNodes {
  int first_piece = 0, pieces = 0;
  int first_single = 0, singles = 0;

  bool operator==(const ChainNodes&) const = default;
};

/// Kind: the rows (kRows) and links (Link) of its joints, and other members of chains (OfChain) and
/// groups (OfGroup). kBeginsFree: chains begin with a body alone instead of a joint on Ground. T =
/// Lanes has a mechanism per lane and hence no pieces. Own: the sweep, with
///
///   MotionBefore               what is followed along pieces
///   FreeOfPack, FreeOfSingle   zeta_i3 of bodies
///   ResponseOfPack, ..Single   their zeta
///   TurnToNext                 handle 2 of an assembly into the axes behind the next joint
///   Start, End                 a chain without bodies; its last joint
///   Close                      joints between chains
///   EndForce                   on the last node of a chain, at its handle 2
///   Respond, RespondSingle     rates of a pack or a single body, from both forces
///   Opposite                   the force on handle 2 of the bodies before
template <class Own, class Kind, class Space, class T>
class ChainSweep : public ShortCut<Space, T> {
 protected:
  static constexpr bool kIsOne = std::is_same_v<T, double>;
  template <class U>
  using Link = typename Kind::template Link<U>;
  static constexpr int kRows = Kind::kRows;
  template <class U>
  using Handles = TwoHandle<U, kRows>;
  template <class U>
  using Force = HandleForce<U, kRows>;

  using Chain = typename Kind::template OfChain<T>;
  /// kLanes pieces side by side.
  struct Group : Kind::OfGroup {
    int pack = 0, length = 0;  ///< its packs
    Handles<Lanes> assemblies;
    Force<Lanes> F1, F2;  ///< on these
    double slack = 0.0;
  };

  /// Appends a chain with so many pieces of this length. `packs` are those of the group that is
  /// being filled, perhaps by several chains.
  Chain& AddChain(std::span<const Link<double>> links, int pieces, int length,
                  std::vector<Link<Lanes>>& packs) {
    Chain& chain = chains_.emplace_back();
    chain.first_piece = num_pieces_;
    chain.pieces = pieces;
    chain.first_single = static_cast<int>(singles_.size());
    auto link = links.begin();
    for (; pieces > 0; --pieces, ++num_pieces_) {
      const int lane = lane_of(num_pieces_);
      if (lane == 0) {
        Group& group = groups_.emplace_back();
        group.pack = packs_.size();
        group.length = length;
        packs.resize(length);
      }
      for (Link<Lanes>& pack : packs) SetLane(pack, lane, *link++);
      if (lane + 1 < kLanes) continue;
      for (const Link<Lanes>& pack : packs) packs_.Add(pack);
    }
    singles_.insert(singles_.end(), link, links.end());
    chain.singles = static_cast<int>(singles_.size()) - chain.first_single;
    return chain;
  }
  /// Ends the layout of all chains.
  void EndChains() {
    packed_ = packs_.size() * kLanes;
    cuts_.resize(packs_.size());
    end_cuts_.resize(num_pieces_ + singles_.size());
  }
  // of unsigned numbers, whose division is one instruction
  const Group& group_of(int piece) const { return groups_[static_cast<unsigned>(piece) / kLanes]; }
  Group& group_of(int piece) { return groups_[static_cast<unsigned>(piece) / kLanes]; }
  static int lane_of(int piece) { return static_cast<int>(static_cast<unsigned>(piece) % kLanes); }
  int place_of_piece(int piece) const { return group_of(piece).pack * kLanes + lane_of(piece); }
  /// Returns the length of a chain's pieces.
  int length(const Chain& chain) const {
    return chain.pieces > 0 ? group_of(chain.first_piece).length : 0;
  }
  /// Returns the place of body k of a chain.
  int place(const Chain& chain, int k) const {
    const int length = this->length(chain), single = k - chain.pieces * length;
    return single < 0 ? place_of_piece(chain.first_piece + k / length) + k % length * kLanes
                      : packed_ + chain.first_single + single;
  }

  /// Returns false near a degenerate position.
  template <Unknowns kUnknowns>
  TruthOf<T> Solve() {
    const int groups = static_cast<int>(groups_.size());
    if constexpr (kIsOne) this->pool_->ForEach(groups, [&](int g) { Up<kUnknowns>(groups_[g]); });
    T slack = {};
    for (Chain& chain : chains_) slack = Min(slack, Up<kUnknowns>(chain));
    slack = own().template Close<kUnknowns>(slack);
    const TruthOf<T> good = slack >= 0.0;
    if (!Any(good)) return good;
    for (const Chain& chain : chains_) Down<kUnknowns>(chain);
    if constexpr (kIsOne) this->pool_->ForEach(groups, [&](int g) { Down<kUnknowns>(groups_[g]); });
    return good;
  }

  std::vector<Chain> chains_;
  std::vector<Group> groups_;
  PackKinds<Link<Lanes>> packs_;
  std::vector<InnerCut<Lanes, kRows>> cuts_;  ///< by pack
  std::vector<Link<T>> singles_;
  std::vector<EndCut<T, kRows>> end_cuts_;  ///< by piece, then by single body
  int num_pieces_ = 0;
  int packed_ = 0;  ///< bodies in pieces

 private:
  Own& own() { return static_cast<Own&>(*this); }

  template <class U>
  static U LimitOf(const Link<U>& link) {
    if constexpr (kRows == 2) return link.limit;
    return U{};
  }

  template <Unknowns kUnknowns>
  void Up(Group& group) {
    Lanes slack = {};
    auto before = own().MotionBefore(group);
    // few numbers stay in registers
    std::conditional_t<kRows == 2, Handles<Lanes>, Handles<Lanes>&> all = group.assemblies;
    const auto first = own().template FreeOfPack<kUnknowns>(group.pack, before);
    all.response = own().ResponseOfPack(group.pack);
    LOOPBENCH_UNROLL
    for (int i = 0; i < kRows; ++i) {
      all.zeta13[i] = first.zeta13[i];
      all.zeta23[i] = first.zeta23[i];
    }
    for (int pack = group.pack + 1; pack < group.pack + group.length; ++pack) {
      const auto free = own().template FreeOfPack<kUnknowns>(pack, before);
      own().TurnToNext(pack * kLanes, all);
      JoinSeries(all, own().ResponseOfPack(pack), free.zeta13, free.zeta23, LimitOf(packs_[pack]),
                 cuts_[pack], slack);
    }
    if constexpr (kRows == 2) group.assemblies = all;
    group.slack = Smallest(slack);
  }

  /// Returns the least slack of all joins of a chain.
  template <Unknowns kUnknowns>
  T Up(Chain& chain) {
    T slack = {};
    OneHandle<T, kRows> all = own().template Start<kUnknowns>(chain);
    for (int piece = chain.first_piece; piece < chain.first_piece + chain.pieces; ++piece) {
      if constexpr (kIsOne) {
        const Group& group = group_of(piece);
        const Handles<double> next = LaneOf<Handles>(group.assemblies, lane_of(piece));
        slack = Min(slack, group.slack);
        Attach(piece, place_of_piece(piece), piece == chain.first_piece, next.response, next.zeta13,
               next.zeta23, LimitOf(packs_[group.pack])[lane_of(piece)], all, slack);
      }
    }
    for (int k = 0; k < chain.singles; ++k) {
      const int single = chain.first_single + k;
      const auto free = own().template FreeOfSingle<kUnknowns>(single);
      Attach(num_pieces_ + single, packed_ + single, k + chain.pieces == 0,
             own().ResponseOfSingle(single), free.zeta13, free.zeta23, LimitOf(singles_[single]),
             all, slack);
    }
    return own().template End<kUnknowns>(chain, all, slack);
  }
  /// Joins a node to the chain.
  LOOPBENCH_INLINE void Attach(int node, int place, bool is_first, const Response<T, kRows>& next,
                               const T* zeta13, const T* zeta23, const T& limit,
                               OneHandle<T, kRows>& all, T& slack) {
    if (Kind::kBeginsFree && is_first) {
      all.zeta22 = next.zeta22;
      std::copy_n(zeta23, kRows, all.zeta23);
    } else {
      own().TurnToNext(place, all);
      all = JoinSeries(all, next, zeta13, zeta23, limit, end_cuts_[node], slack);
    }
  }

  /// From the end of a chain: the force in the joint before a node, then the body's rates. Forces
  /// on pieces are those in the joints between them.
  template <Unknowns kUnknowns>
  void Down(const Chain& chain) {
    Force<T> F2 = own().template EndForce<kUnknowns>(chain);
    for (int k = chain.singles - 1; k >= 0; --k) {
      const int single = chain.first_single + k;
      const Force<T> F1 = ForceBefore(num_pieces_ + single, k + chain.pieces == 0, F2);
      own().template RespondSingle<kUnknowns>(single, F1, F2);
      F2 = own().Opposite(packed_ + single, F1);
    }
    for (int piece = chain.first_piece + chain.pieces - 1; piece >= chain.first_piece; --piece) {
      if constexpr (kIsOne) {
        const Force<double> F1 = ForceBefore(piece, piece == chain.first_piece, F2);
        SetLane<Force>(group_of(piece).F1, lane_of(piece), F1);
        SetLane<Force>(group_of(piece).F2, lane_of(piece), F2);
        F2 = own().Opposite(place_of_piece(piece), F1);
      }
    }
  }
  Force<T> ForceBefore(int node, bool is_first, const Force<T>& F2) const {
    Force<T> F1 = {};
    if (!Kind::kBeginsFree || !is_first) ForceIn(end_cuts_[node], F2.at, F1.at);
    return F1;
  }

  template <Unknowns kUnknowns>
  void Down(Group& group) {
    Force<Lanes> F2 = group.F2;
    for (int pack = group.pack + group.length - 1; pack >= group.pack; --pack) {
      Force<Lanes> F1 = group.F1;
      if (pack > group.pack) {
        ForceIn(cuts_[pack], own().ResponseOfPack(pack), group.F1.at, F2.at, F1.at);
      }
      own().template Respond<kUnknowns>(group, pack, F1, F2);
      F2 = own().Opposite(pack * kLanes, F1);
    }
  }
};

}  // namespace loopbench::odca
