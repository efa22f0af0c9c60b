// Where the bodies of a store's scenes are over time: from trajectories and references that are
// kept beside it. Nothing is integrated here.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "harness/view/picture.h"

namespace loopbench::harness {

/// The motion of one run, or of a reference.
struct ReportPath {
  std::string label = {};
  std::optional<std::size_t> row = {};  ///< of the run; none for a reference
  std::vector<double> times = {};       ///< [s], ascending
  std::vector<Poses> poses = {};        ///< by time
  std::size_t stored = 0;               ///< times that the file has
};

/// One mechanism with its motions.
struct ReportScene {
  std::string name = {};                ///< as in ReportTable::scenes
  std::optional<Picture> picture = {};  ///< none: see `missing`
  std::vector<ReportPath> paths = {};
  std::string missing =
      {};  ///< why there is no motion, and what to write into the experiment; or empty
};

/// Scenes in the order of the rows, whose names and scenes are given beside them. `changed` gets
/// the messages of files that are not as their run wrote them.
std::vector<ReportScene> FindScenes(const std::vector<Record>& rows,
                                    const std::vector<std::string>& names,
                                    const std::vector<std::string>& scenes,
                                    const std::filesystem::path& store_file,
                                    std::vector<std::string>* remarks,
                                    std::vector<std::string>* changed);

/// Above so many scenes none is drawn any more, above so many motions none of a scene; and places
/// of bodies in all motions of a page.
inline constexpr std::size_t kMostScenes = 12, kMostPaths = 60, kMostPlaces = 120'000;

}  // namespace loopbench::harness
