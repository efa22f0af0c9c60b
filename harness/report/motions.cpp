#include "harness/report/motions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "harness/reference/reference.h"
#include "harness/report/decimate.h"
#include "harness/suite/kept_files.h"
#include "harness/trajectory/store_files.h"
#include "harness/trajectory/trajectory.h"

namespace loopbench::harness {
namespace {

/// Where the poses of all bodies but Ground stand in a trajectory's rows.
std::vector<PoseColumns> PosesIn(const TrajectoryReader& file, const MechanismDescription& user) {
  std::vector<PoseColumns> columns;
  for (std::size_t body = 1; body < user.bodies.size(); ++body) {
    const auto found = FindPose(file.columns(), user.bodies[body].name);
    if (!found) {
      throw std::runtime_error("it has no pose of body " + user.bodies[body].name +
                               " (\"bodies\" in \"output\" of the experiment)");
    }
    columns.push_back(*found);
  }
  return columns;
}

/// Poses in those rows of a trajectory that a page can show, of `rows` as its record says; a file
/// of any length is read in memory of a fixed size.
ReportPath PathOf(const std::filesystem::path& path, const MechanismDescription& user,
                  std::size_t rows, std::size_t most) {
  TrajectoryReader file(path);
  const std::vector<PoseColumns> columns = PosesIn(file, user);
  const std::vector<std::size_t> wanted = KeepEvenly(rows, most);
  ReportPath found;
  std::vector<double> row;
  auto next = wanted.begin();
  for (; file.Next(&row); ++found.stored) {
    if (next == wanted.end() || *next != found.stored) continue;
    ++next;
    Poses poses(user.bodies.size());
    bool is_known = true;
    for (std::size_t body = 1; body < poses.size(); ++body) {
      poses[body] = columns[body - 1].At(row.data());
      is_known = is_known && poses[body].p.allFinite() && poses[body].R.allFinite();
    }
    if (!is_known) continue;
    found.times.push_back(row[file.time()]);
    found.poses.push_back(std::move(poses));
  }
  return found;
}

ReportPath PathOf(const Reference& reference, std::size_t most) {
  ReportPath path;
  path.label = fmt::format("certified reference ({}, to {:.1g} m)", reference.scalar,
                           reference.Certified().position);
  path.stored = reference.NumTrusted();
  for (const std::size_t k : KeepEvenly(path.stored, most)) {
    Poses poses;
    for (const BodyState& body : reference.snapshots[k].bodies) poses.push_back(body.pose);
    path.times.push_back(reference.times[k]);
    path.poses.push_back(std::move(poses));
  }
  return path;
}

/// One scene, with the rows that belong to it.
struct Work {
  const std::vector<Record>& records;
  const std::vector<std::string>& names;
  const std::filesystem::path& store_file;
  std::vector<std::size_t> rows;
  std::size_t most_places = 0;  ///< of bodies, in all motions of the scene
};

/// The files that rows name, each once: of references rows share one.
std::vector<std::string> ReferencesOf(const Work& work) {
  std::vector<std::string> ids;
  for (const std::size_t row : work.rows) {
    if (ReferenceOf(work.records[row], work.store_file).empty()) continue;
    const std::string id = work.records[row].Text("reference_file");
    if (std::ranges::find(ids, id) == ids.end()) ids.push_back(id);
  }
  return ids;
}

void AddPaths(const Work& work, const MechanismDescription& user, ReportScene* scene,
              std::vector<std::string>* remarks, std::vector<std::string>* changed) {
  std::vector<std::size_t> with_file;
  for (const std::size_t row : work.rows) {
    const auto path = TrajectoryOf(work.records[row], work.store_file);
    if (!path.empty() && std::filesystem::exists(path)) with_file.push_back(row);
  }
  if (with_file.size() > kMostPaths) {
    remarks->push_back(fmt::format("{}: motions of the first {} of {} runs are in this page",
                                   scene->name, kMostPaths, with_file.size()));
    with_file.resize(kMostPaths);
  }
  const std::vector<std::string> references = ReferencesOf(work);
  const std::size_t paths = std::max<std::size_t>(1, with_file.size() + references.size());
  const std::size_t most = work.most_places / (paths * user.bodies.size());
  const auto add = [&](ReportPath path, const std::string& label) {
    if (path.times.size() < path.stored) {
      remarks->push_back(fmt::format("motion of {}, {}: {} of its {} times are in this page",
                                     scene->name, label, path.times.size(), path.stored));
    }
    if (path.times.size() > 1) scene->paths.push_back(std::move(path));
  };
  const auto fail = [&](const std::string& label, const std::exception& error) {
    remarks->push_back(fmt::format("{}, {}: no motion: {}", scene->name, label, error.what()));
  };
  for (const std::string& id : references) {
    try {
      const auto file = ReferencePath(work.store_file, id);
      const auto reference = ReadReference(file, id, user);
      if (!reference) throw std::runtime_error(file.string() + " is not there");
      add(PathOf(*reference, most), "reference");
    } catch (const std::runtime_error& error) {
      fail("reference", error);
    }
  }
  for (const std::size_t row : with_file) {
    try {
      const double count = work.records[row].Number("trajectory_rows");
      const auto file = TrajectoryOf(work.records[row], work.store_file);
      VerifyTrajectory(work.records[row], file);
      ReportPath path =
          PathOf(file, user, count > 0 ? static_cast<std::size_t>(count) : most, most);
      path.label = work.names[row];
      path.row = row;
      add(std::move(path), work.names[row]);
    } catch (const ChangedFile& error) {
      changed->emplace_back(error.what());
      fail(work.names[row], error);
    } catch (const std::runtime_error& error) {
      fail(work.names[row], error);
    }
  }
}

void Fill(const Work& work, ReportScene* scene, std::vector<std::string>* remarks,
          std::vector<std::string>* changed) {
  const auto file = MechanismOf(work.records[work.rows.front()], work.store_file);
  if (file.empty() || !std::filesystem::exists(file)) {
    scene->missing =
        "The store keeps no motion of this scene: a run keeps one with \"output\": {\"step\": "
        "0.01} (each run) or \"reference\": {} (the certified motion) in the experiment.";
    return;
  }
  try {
    const MechanismDescription user = ReadKeptMechanism(file);
    scene->picture = MakePicture(user, "mechanisms/" + file.filename().string());
    scene->picture->motions.clear();  // those of degrees of freedom are for `view`
    AddPaths(work, user, scene, remarks, changed);
  } catch (const ChangedFile& error) {
    changed->emplace_back(error.what());
    scene->missing = error.what();
    return;
  } catch (const std::exception& error) {
    scene->missing = error.what();
    return;
  }
  if (scene->paths.empty()) {
    scene->missing =
        "No motion of this scene could be read (what is left out is said at the end of the page); "
        "with \"output\": {\"step\": 0.01} in the experiment a run keeps its own.";
  }
}

}  // namespace

std::vector<ReportScene> FindScenes(const std::vector<Record>& rows,
                                    const std::vector<std::string>& names,
                                    const std::vector<std::string>& scenes,
                                    const std::filesystem::path& store_file,
                                    std::vector<std::string>* remarks,
                                    std::vector<std::string>* changed) {
  std::vector<ReportScene> found;
  std::vector<std::vector<std::size_t>> members;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    auto at = static_cast<std::size_t>(std::ranges::find(found, scenes[row], &ReportScene::name) -
                                       found.begin());
    if (at == found.size()) {
      found.push_back({.name = scenes[row]});
      members.emplace_back();
    }
    members[at].push_back(row);
  }
  const std::size_t shown = std::min(found.size(), kMostScenes);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (i >= shown) {
      found[i].missing = fmt::format(
          "Pictures are of the first {} scenes of a store; for this one "
          "make a store of its own (loopbench merge, --filter of run).",
          kMostScenes);
      continue;
    }
    Fill({rows, names, store_file, members[i], kMostPlaces / shown}, &found[i], remarks, changed);
  }
  return found;
}

}  // namespace loopbench::harness
