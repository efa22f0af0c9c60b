// Pictures of mechanisms: what is drawn is what there is, whoever named it and however large it is.
#include "harness/figures/view.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <regex>

#include "harness/config/mechanism_reader.h"
#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"
#include "mechanism/simplify/structure.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/in_child.h"
#include "tests/harness/places.h"
#include "tests/harness/xml_fault.h"

namespace loopbench::harness {
namespace view_test {

using Eigen::Vector3d;

struct Drawn {
  fs::path file;
  MechanismDescription description;
  Picture picture;
};

const std::vector<Drawn>& Shipped() {
  static const std::vector<Drawn> all = [] {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(kConfigs / "mechanisms")) {
      if (entry.path().extension() == ".json") files.push_back(entry.path());
    }
    for (const auto& entry : fs::directory_iterator(kConfigs / "experiments/models")) {
      if (entry.is_directory()) files.push_back(entry.path() / "full.json");
    }
    std::vector<Drawn> drawn;
    for (const fs::path& file : files) {
      const MechanismDescription description = ReadMechanism(file).description;
      drawn.push_back({file, description, MakePicture(description, file.string())});
    }
    return drawn;
  }();
  return all;
}

Picture PictureOf(const std::string& name) {
  return MakePicture(ReadMechanism(kConfigs / "mechanisms" / (name + ".json")).description, "");
}

bool HasBadNumber(const std::string& text) {
  static const std::regex bad("[ \",:\\[LM](nan|-nan|inf|-inf)[ \",\\]LMZ]");
  return std::regex_search(text, bad);
}

TEST(View, EveryShippedMechanismIsDrawn) {
  ASSERT_GE(Shipped().size(), 43u);
  for (const auto& [file, description, picture] : Shipped()) {
    SCOPED_TRACE(file.string());
    EXPECT_TRUE(picture.assembled);
    EXPECT_FALSE(picture.motions.empty());
    for (const std::string view : {"oblique", "top"}) {
      const std::string svg = ToSvg(picture, {.view = view});
      EXPECT_EQ(FaultOfXml(svg), "");
      EXPECT_FALSE(HasBadNumber(svg));
      EXPECT_LT(svg.size(), 60'000u);
    }
    const std::string html = ToHtml(picture);
    EXPECT_EQ(CountOf(html, "</script>"), 2u);
    EXPECT_FALSE(HasBadNumber(ToJson(picture)));
    for (const Table& table : ToTables(picture)) EXPECT_FALSE(HasBadNumber(ToText(table)));
  }
}

/// How far the two sides of a joint are from what it permits at these poses [m]: the points of pins
/// and balls coincide, sliders stay on their axis, rods keep their length.
double Openness(const JointDescription& joint, const Poses& poses) {
  const auto pose = [&](int body) { return poses[static_cast<std::size_t>(body)]; };
  const JointPlaces places = PlacesOf(joint);
  const Frame X = (pose(joint.from.body) * places.F).Inverse() * (pose(joint.to.body) * places.M);
  switch (joint.type) {
    case JointType::kRevolute:
    case JointType::kSpherical:
    case JointType::kUniversal:
    case JointType::kWeld:
      return X.p.norm();
    case JointType::kPrismatic:
    case JointType::kPinInSlot:
    case JointType::kPointOnLine:
      return X.p.tail<2>().norm();
    case JointType::kCylindrical:
      return X.p.head<2>().norm();
    case JointType::kPlanar:
    case JointType::kPointInPlane:
      return std::abs(X.p.z());
    case JointType::kHelical:
      return X.p.head<2>().norm() +
             std::abs(std::remainder(X.p.z() / joint.parameter - std::atan2(X.R(1, 0), X.R(0, 0)),
                                     2 * std::acos(-1.0)) *
                      joint.parameter);
    case JointType::kRod:
      return std::abs(X.p.norm() - joint.parameter);
    default:
      return 0.0;
  }
}

// Frames are closed to 1e-10 of the mechanism's length in the metric of unit masses, of which a
// joint's gap is a small multiple.
TEST(View, LinksKeepTheirLengthsInAllMotions) {
  int frames = 0;
  for (const auto& [file, description, picture] : Shipped()) {
    for (const PictureMotion& motion : picture.motions) {
      if (motion.text.starts_with("to first order")) continue;
      for (const Poses& poses : motion.frames) {
        ++frames;
        for (const JointDescription& joint : description.joints) {
          EXPECT_LT(Openness(joint, poses), 1e-8 * picture.extent)
              << file << " " << motion.name << " " << joint.name;
        }
      }
      const auto moved = [&start = picture.start, &extent = picture.extent](const Poses& poses) {
        double most = 0.0;
        for (std::size_t b = 0; b < poses.size(); ++b) {
          most = std::max(
              most, (poses[b].p - start[b].p).norm() / extent + (poses[b].R - start[b].R).norm());
        }
        return most;
      };
      const auto most = std::ranges::max(motion.frames, {}, moved);
      EXPECT_GT(moved(most), 1e-3) << file << " " << motion.name;
      EXPECT_LT(moved(motion.frames[static_cast<std::size_t>(motion.start)]), 1e-12);
    }
  }
  EXPECT_GT(frames, 1000);
}

TEST(View, ShowsAsManyMotionsAsThereAreDegreesOfFreedom) {
  for (const auto& [file, description, picture] : Shipped()) {
    EXPECT_EQ(std::ranges::count_if(picture.motions, &PictureMotion::returns),
              AnalyseStructure(description).freedom_at_start())
        << file;
  }
}

TEST(View, SwingsASliderCrankAsItsTriangleSays) {
  const MechanismDescription description =
      ReadMechanism(kConfigs / "experiments/models/light-rod-compressor/full.json").description;
  const Picture picture = MakePicture(description, "");
  ASSERT_EQ(picture.motions.size(), 1u);
  const auto body = [&](const char* name) {
    return static_cast<std::size_t>(
        std::ranges::find(description.bodies, name, &BodyDescription::name) -
        description.bodies.begin());
  };
  const auto joint = [&](const char* name) {
    return *std::ranges::find(description.joints, name, &JointDescription::name);
  };
  const double r = (joint("A").from.position - joint("O").to.position).norm();
  const double l = (joint("B").from.position - joint("A").to.position).norm();
  for (const Poses& poses : picture.motions[0].frames) {
    const Frame& crank = poses[body("crank")];
    const Vector3d pin = crank.p + crank.R * joint("A").from.position;
    const Frame& piston = poses[body("piston")];
    const Vector3d wrist = piston.p + piston.R * joint("B").to.position;
    EXPECT_NEAR(pin.norm(), r, 1e-8);
    EXPECT_NEAR(wrist.x(), pin.x() + std::sqrt(l * l - pin.y() * pin.y()), 1e-8);
  }
}

/// Without links, the length of the mechanism is 1: shifts and angles have the same unit of speed.
TEST(View, SwingsOfShiftsAreLengths) {
  MechanismDescription description;
  description.name = "shifts";
  description.space = SpaceKind::kSpatial;
  description.bodies.push_back(Bar("b", 1.0, 1.0, 1.0));
  JointDescription joint;
  joint.name = "j";
  joint.type = JointType::kSchoenflies;
  joint.to.body = 1;
  description.joints = {joint};
  const Picture picture = MakePicture(description, "");
  ASSERT_EQ(picture.motions.size(), 4u);
  const char* const names[] = {"j.angle", "j.x", "j.y", "j.z"};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(picture.motions[i].name, names[i]);
    ExpectPart(picture.motions[i].text, i == 0 ? " rad;" : " m;");
  }
}

TEST(View, SaysHowFarLoopsAreOpenInTheFile) {
  MechanismDescription description =
      ReadMechanism(kConfigs / "mechanisms/four-bar.json").description;
  for (JointValues& values : description.initial.coordinates) values.values = {0.0};
  const Picture picture = MakePicture(description, "");
  // all bars lie along x, so that their ends are where their lengths add up
  double reach = 0.0;
  for (std::size_t j = 0; j + 1 < description.joints.size(); ++j) {
    reach += description.joints[j + 1].from.position.x() - description.joints[j].to.position.x();
  }
  ASSERT_EQ(picture.loops.size(), 1u);
  EXPECT_NEAR(picture.loops[0].gap, std::abs(reach - 1.5), 1e-12);
  EXPECT_LT(picture.loops[0].left, 1e-10);
  ExpectPart(ToSvg(picture, {}), "open by");
  EXPECT_EQ(ToSvg(picture, {.plain = true}).find("open by"), std::string::npos);
}

TEST(View, SizeOfTheMechanismChangesNothingButTheScale) {
  const MechanismDescription description =
      ReadMechanism(kConfigs / "mechanisms/driven-four-bar.json").description;
  const std::regex scale("[0-9.e+-]+ m<");
  const auto drawn = [&](double factor) {
    const MechanismDescription scaled = AtScale(description, factor);
    return std::regex_replace(ToSvg(MakePicture(scaled, ""), {}), scale, "<");
  };
  // powers of two, which round nothing; of the assembly round-off is left, below a pixel's
  // hundredth
  const std::string whole = drawn(1.0);
  const auto words = [](const std::string& svg) {
    return CountOf(svg, "<path") + CountOf(svg, "<text");
  };
  for (const double factor : {0x1p-20, 0x1p20}) {
    const std::string other = drawn(factor);
    EXPECT_EQ(words(other), words(whole));
    EXPECT_NEAR(static_cast<double>(other.size()), static_cast<double>(whole.size()),
                0.01 * static_cast<double>(whole.size()));
    EXPECT_FALSE(HasBadNumber(other));
  }
}

TEST(View, OneOfNoSizeIsDrawn) {
  MechanismDescription description;
  description.name = "point";
  description.bodies.push_back({.name = "b",
                                .mass = 1.0,
                                .com = Vector3d::Zero(),
                                .inertia = Eigen::Matrix3d::Identity(),
                                .points = {}});
  description.joints.push_back(Revolute("J", kGround, Vector3d::Zero(), 1, Vector3d::Zero()));
  for (const SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
    description.space = space;
    const Picture picture = MakePicture(description, "");
    EXPECT_EQ(FaultOfXml(ToSvg(picture, {})), "");
    EXPECT_FALSE(HasBadNumber(ToSvg(picture, {})));
    EXPECT_EQ(picture.motions.size(), 1u);
  }
}

TEST(View, NamesAreOnlyShown) {
  const std::string evil =
      "</script><img src=x onerror=alert(1)>'\"`${1}\\\n\xe2\x80\xa8\x1b[2J&{0}\xff";
  MechanismDescription description =
      ReadMechanism(kConfigs / "mechanisms/welded-four-bar.json").description;
  description.name = evil;
  for (BodyDescription& body : description.bodies) body.name += evil;
  for (JointDescription& joint : description.joints) joint.name += evil;
  description.independent.clear();
  const Picture picture = MakePicture(description, evil);
  const std::string svg = ToSvg(picture, {}), html = ToHtml(picture), data = ToJson(picture);
  EXPECT_EQ(FaultOfXml(svg), "");
  EXPECT_EQ(svg.find("<img"), std::string::npos);
  EXPECT_EQ(CountOf(html, "</script>"), 2u);
  EXPECT_EQ(html.find("<img"), std::string::npos);
  EXPECT_EQ(data.find_first_of("<>&\n\x1b"), std::string::npos);
  EXPECT_EQ(data.find("\xe2\x80\xa8"), std::string::npos);
  EXPECT_EQ(data.find('\xff'), std::string::npos);
}

TEST(View, NamedPointsAreInTheOutlineAndHavePaths) {
  MechanismDescription description =
      ReadMechanism(kConfigs / "mechanisms/four-bar.json").description;
  description.bodies[2].points["tip"] = {0.5, 2.0, 0.0};
  const std::vector<Vector3d> places = Attachments(description)[2];
  EXPECT_NE(std::ranges::find(places, Vector3d(0.5, 2.0, 0.0)), places.end());
  const std::string name = "\"" + description.bodies[2].name + ":tip\"";
  ExpectPart(ToJson(MakePicture(description, "")), "{\"name\":" + name + ",\"at\":[2,0.5,2,0]}");
}

TEST(View, LargeOnesAreBounded) {
  const Picture ladder = MakePicture(Ladder(500, 1.0, 1.0), "");
  EXPECT_TRUE(ladder.assembled);
  EXPECT_LT(ToHtml(ladder).size(), 2'000'000u);
  EXPECT_LT(ToSvg(ladder, {}).size(), 300'000u);
  ExpectPart(Joined(ladder.notes, "; "), "speeds, followed are up to");
  const Picture chain = MakePicture(Tree(10000, 1.0), "");
  EXPECT_LT(ToHtml(chain).size(), 8'000'000u);
  // all bars are seen: some four paths each
  EXPECT_LT(ToSvg(chain, {}).size(), 5'000'000u);
  for (const PictureMotion& motion : chain.motions) {
    EXPECT_LE(motion.frames.size() * chain.bodies, kMaxFrames);
  }
}

TEST(View, MarksWhatARunLeavesOutAndWhatIsRedundant) {
  const auto gone = [](const std::string& mechanism, const std::string& what) {
    return std::ranges::count_if(
        PictureOf(mechanism).items, [&](const std::string& text) { return text.starts_with(what); },
        &PictureItem::gone);
  };
  EXPECT_EQ(gone("welded-four-bar", "moves as one with"), 6);
  EXPECT_EQ(gone("truss", "does not move"), 6);
  const Picture bennett = PictureOf("bennett");
  EXPECT_EQ(bennett.loops.at(0).redundant.size(), 3u);
  EXPECT_EQ(bennett.loops.at(0).bodies.size(), 4u);
}

TEST(View, SaysThatNothingMoves) {
  // three bars, pinned to each other in a triangle and to Ground at two corners
  MechanismDescription truss;
  truss.name = "triangle";
  truss.bodies.push_back(Bar("a", 1.0, 1.0, 1.0));
  truss.bodies.push_back(Bar("b", 1.0, 1.0, 1.0));
  truss.joints = {Revolute("A", kGround, Vector3d(0, 0, 0), 1, Vector3d(0, 0, 0)),
                  Revolute("B", kGround, Vector3d(1, 0, 0), 2, Vector3d(0, 0, 0)),
                  Revolute("C", 1, Vector3d(1, 0, 0), 2, Vector3d(1, 0, 0))};
  truss.joints[2].cut = true;
  truss.initial.coordinates = {{0, {1.0}}, {1, {2.0}}};
  const Picture picture = MakePicture(truss, "");
  EXPECT_TRUE(picture.assembled);
  EXPECT_TRUE(picture.motions.empty());
  ExpectPart(Joined(picture.notes, "; "), "nothing can move");
  EXPECT_EQ(FaultOfXml(ToSvg(picture, {})), "");
}

TEST(Hull, OfLinesPolygonsAndSolids) {
  const Vector3d o(0, 0, 0), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  EXPECT_TRUE(HullFaces({o, 1e-9 * x}, 1e-6).empty());
  EXPECT_EQ(HullFaces({o, 0.5 * x, x}, 1e-6), (std::vector<std::vector<int>>{{0, 2}}));
  const auto square = HullFaces({o, x, x + y, y, 0.5 * (x + y)}, 1e-6);
  ASSERT_EQ(square.size(), 1u);
  EXPECT_EQ(square[0].size(), 4u);
  EXPECT_EQ(HullFaces({o, x, y, z}, 1e-6).size(), 4u);
  EXPECT_EQ(HullFaces({o, x, y, z, Vector3d(0.1, 0.1, 0.1)}, 1e-6).size(), 4u);
}

TEST(Scale, IsRound) {
  EXPECT_DOUBLE_EQ(RoundLength(0.73), 0.5);
  EXPECT_DOUBLE_EQ(RoundLength(2.1e-7), 2e-7);
  EXPECT_DOUBLE_EQ(RoundLength(1.9e6), 1e6);
}

class ViewCommandLine : public CommandLineTest {};

TEST_F(ViewCommandLine, WritesWhatIsAskedFor) {
  ExpectEnding(Call("view four-bar.json"), 0,
               {"wrote four-bar.html", "3 bodies, 4 joints, 1 motion"});
  ExpectEnding(Call("view four-bar.json --out a/b.svg --no-annotations"), 0, {"wrote a/b.svg"});
  EXPECT_TRUE(ReadFile(folder_ / "a/b.svg").starts_with("<?xml"));
  EXPECT_TRUE(ReadFile(folder_ / "four-bar.html").starts_with("<!doctype html>"));
  ExpectEnding(Call("view four-bar.json --format text"), 0, {"Bodies, as assembled", "Motions"});
  ExpectEnding(Call("view tiny.json"), 2, {"tiny.json"});
  ExpectEnding(Call("view four-bar.json --view side"), 2, {"--view is for svg"});
  ExpectEnding(Call("view four-bar.json --format pdf"), 2, {"--format"});
}

TEST_F(ViewCommandLine, DrawsWhatDoesNotAssemble) {
  EditMechanism("\"BC\": 1.757330},\n    \"fixed\": [\"OA\"]",
                "\"BC\": 0.5},\n    \"fixed\": [\"OA\", \"AB\", \"BC\"]");
  const Ending ending = Call("view four-bar.json --out open.svg");
  ExpectEnding(ending, 2, {"wrote open.svg", "not assembled"});
  const std::string svg = ReadFile(folder_ / "open.svg");
  ExpectPart(svg, "NOT ASSEMBLED");
  ExpectPart(svg, "open by");
}

}  // namespace view_test
}  // namespace loopbench::harness
