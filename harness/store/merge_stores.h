// Several stores of one experiment into one: every case once.
#pragma once

#include <deque>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "harness/record/record.h"
#include "harness/store/record_lines.h"

namespace loopbench::harness {

/// One record per "id", at the place of its first; records without one all stay. Of a case that was
/// run more than once a record whose ending the clock or the machine decided (time-limit, crashed,
/// ...) gives way to one that was not, and else to the last.
///
/// Of each record its place is kept, some 280 bytes with its id: a million of them are merged in as
/// many megabytes.
class MergedStores {
 public:
  /// Reads all of the stores once. Records of one id come from one program and one case: two that
  /// were not cut short agree in all but times, noise and origin. Throws std::runtime_error that
  /// names both files, the case, the key and both values where they do not, as ReadRecords() does,
  /// and for a store whose last line is torn.
  /// @param order  "id"s, each once: these first, in this order
  MergedStores(const std::vector<std::filesystem::path>& stores,
               const std::vector<std::string>& order = {});
  ~MergedStores();
  MergedStores(const MergedStores&) = delete;
  MergedStores& operator=(const MergedStores&) = delete;

  std::size_t read() const { return read_; }                            ///< records of all stores
  std::size_t size() const { return kept_.size(); }                     ///< that are left
  const std::vector<std::string>& missing() const { return missing_; }  ///< of `order`, in no store

  /// Reads the record from its store.
  Record operator[](std::size_t i) const;

  /// The stores whose run this is, that of the record first: what they keep beside their records
  /// belongs to it, and what other stores keep of the case is another run's.
  std::vector<std::filesystem::path> StoresOf(std::size_t i) const;

 private:
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);
  struct Kept {
    std::size_t part = kNowhere;
    LinePlace place = {};
    bool was_cut_short = false;
    std::vector<std::size_t> equals = {};  ///< parts before it with the same run
  };
  void Keep(const Record& record, Kept fresh, Kept* known) const;
  Record Read(const Kept& kept) const;
  int Open(std::size_t part) const;

  std::vector<std::filesystem::path> stores_;
  mutable std::deque<std::pair<std::size_t, int>>
      open_;  ///< parts and their descriptors, oldest first
  std::vector<Kept> kept_;
  std::vector<std::string> missing_;
  std::size_t read_ = 0;
};

}  // namespace loopbench::harness
