// Masses of meshes and shapes against closed forms, and meshes that are refused.
#include "harness/exchange/solids.h"

#include "tests/harness/import_texts.h"

namespace loopbench::harness::solids_test {

namespace fs = std::filesystem;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kEps = 2.2e-16;

/// A surface from n x m points over two periodic parameters.
template <class Point>
TriangleMesh Periodic(int n, int m, const Point& point) {
  TriangleMesh mesh;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      mesh.points.push_back(point(2.0 * pi * i / n, 2.0 * pi * j / m));
      const auto at = [&](int a, int b) { return (a % n) * m + b % m; };
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

/// A box with edges a, b, c and one corner at the origin.
TriangleMesh Box(const Vector3d& size) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.points.push_back(size.cwiseProduct(Vector3d(i & 1, i >> 1 & 1, i >> 2)));
  for (const auto& [a, b, c, d] : {std::array{0, 2, 3, 1},
                                   {4, 5, 7, 6},
                                   {0, 1, 5, 4},
                                   {2, 6, 7, 3},
                                   {0, 4, 6, 2},
                                   {1, 3, 7, 5}}) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  return mesh;
}

/// An octahedron whose triangles were halved `times` times, points on the unit sphere.
TriangleMesh Sphere(int times) {
  TriangleMesh mesh;
  for (const double sign : {1.0, -1.0}) {
    for (int k = 0; k < 3; ++k) mesh.points.push_back(sign * Vector3d::Unit(k));
  }
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 0, 2},
                    {1, 0, 5}, {3, 1, 5}, {4, 3, 5}, {0, 4, 5}};
  for (; times > 0; --times) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [at, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<int>(mesh.points.size()));
      if (is_new) mesh.points.push_back((mesh.points[a] + mesh.points[b]).normalized());
      return at->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

TriangleMesh Torus(int n) {
  constexpr double kR = 1.0, kSmall = 0.3;
  return Periodic(n, n, [](double along, double around) {
    const double r = kR + kSmall * std::cos(around);
    return Vector3d(r * std::cos(along), r * std::sin(along), kSmall * std::sin(around));
  });
}

TEST(Solids, BoxesHaveTheirClosedForm) {
  const Vector3d size(0.3, 0.5, 1.1);
  const TriangleMesh mesh = Box(size);
  EXPECT_EQ(NumOpenEdges(mesh), 0u);
  const Solid expected = BoxOf(0.5 * size);
  for (const MeshRule rule : {MeshRule::kEnclosed, MeshRule::kPyramids}) {
    const Solid solid = SolidOf(mesh, rule);
    // sums of 12 pyramids, each of a few products
    EXPECT_NEAR(solid.volume, expected.volume, 64 * kEps * expected.volume);
    EXPECT_LE((solid.centre - 0.5 * size).norm(), 64 * kEps);
    EXPECT_LE((solid.inertia - expected.inertia).norm(), 128 * kEps * expected.inertia.norm());
  }
}

/// Inscribed polyhedra: errors are of second order in the size of the triangles.
TEST(Solids, SpheresAndToriConvergeToTheirClosedForms) {
  struct Row {
    Solid coarse, fine;
    double volume;
    Vector3d moments;
  };
  const double R = 1.0, r = 0.3;
  const double about_z = R * R + 0.75 * r * r, across = 0.5 * R * R + 0.625 * r * r;
  const Row rows[] = {
      {SolidOf(Sphere(3), MeshRule::kEnclosed), SolidOf(Sphere(4), MeshRule::kEnclosed),
       4.0 / 3.0 * pi, Vector3d::Constant(0.4)},
      {SolidOf(Sphere(3), MeshRule::kShell), SolidOf(Sphere(4), MeshRule::kShell), 4.0 * pi,
       Vector3d::Constant(2.0 / 3.0)},
      {SolidOf(Torus(32), MeshRule::kEnclosed),
       SolidOf(Torus(64), MeshRule::kEnclosed),
       2.0 * pi * pi * R * r * r,
       {across, across, about_z}}};
  for (const Row& row : rows) {
    const auto errors = [&](const Solid& solid) {
      const Matrix3d moments = row.moments.asDiagonal();
      return std::pair(std::abs(solid.volume - row.volume) / row.volume,
                       (solid.inertia - moments).norm() / moments.norm());
    };
    const auto coarse = errors(row.coarse), fine = errors(row.fine);
    EXPECT_NEAR(coarse.first / fine.first, 4.0, 0.2);
    EXPECT_NEAR(coarse.second / fine.second, 4.0, 0.2);
    EXPECT_LE(fine.first, 0.01);
    EXPECT_LE(row.fine.centre.norm(), 1e-14);
  }
}

TEST(Solids, PositivePyramidsCountOutsideTwice) {
  const double exact = SolidOf(Torus(32), MeshRule::kEnclosed).volume;
  EXPECT_GT(SolidOf(Torus(32), MeshRule::kPyramids).volume, 1.2 * exact);
}

/// Random points in a ball, a cube's grid, and a torus, whose hull fills the hole.
TEST(Solids, HullsAreClosedAndContainTheirPoints) {
  std::mt19937_64 generator(3);
  const auto random = [&] { return static_cast<double>(generator() >> 11) * 0x1p-52 - 1.0; };
  std::vector<std::vector<Eigen::Vector3d>> sets(3);
  while (sets[0].size() < 500) {
    const Eigen::Vector3d p(random(), random(), random());
    if (p.norm() < 1.0) sets[0].push_back(p);
  }
  for (int i = 0; i < 125; ++i) sets[1].emplace_back(i % 5, i / 5 % 5, i / 25);
  for (int i = 0; i < 400; ++i) {
    const double u = 0.05 * std::numbers::pi * (i % 40), v = 0.2 * std::numbers::pi * (i / 40);
    sets[2].emplace_back((3 + std::cos(v)) * std::cos(u), (3 + std::cos(v)) * std::sin(u),
                         std::sin(v));
  }
  for (const auto& points : sets) {
    const TriangleMesh hull = ConvexHullOf(points);
    EXPECT_EQ(NumOpenEdges(hull), 0u);
    for (const auto& [a, b, c] : hull.triangles) {
      const Eigen::Vector3d normal =
          (points[b] - points[a]).cross(points[c] - points[a]).normalized();
      for (const Eigen::Vector3d& p : points) {
        EXPECT_LE(normal.dot(p - points[a]), 1e-11);  // ten times the accepted 1e-12 of the extent
      }
    }
  }
  EXPECT_NEAR(SolidOf(ConvexHullOf(sets[1]), MeshRule::kEnclosed).volume, 64.0, 64 * 64 * kEps);
  EXPECT_TRUE(ConvexHullOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}).triangles.empty());
  EXPECT_TRUE(ConvexHullOf({}).triangles.empty());
}

TEST(Solids, ReversedAndOpenMeshesAreSeen) {
  TriangleMesh mesh = Box({1, 1, 1});
  for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_NEAR(SolidOf(mesh, MeshRule::kEnclosed).volume, -1.0, 64 * kEps);
  EXPECT_EQ(NumOpenEdges(mesh), 0u);
  mesh.triangles.pop_back();
  EXPECT_EQ(NumOpenEdges(mesh), 3u);
  EXPECT_EQ(SolidOf({}, MeshRule::kEnclosed).volume, 0.0);
}

/// A model folder with meshes.
class MeshFiles : public ModelFolder {
 protected:
  void ExpectFault(const std::string& name, const std::string& text,
                   const std::string& words) const {
    Write(name, text);
    ExpectSaid(MessageOf([&] { ReadMesh(model_ / name); }), {words});
  }
};

std::string AsObj(const TriangleMesh& mesh) {
  std::string text = "# box\n";
  const int count = static_cast<int>(mesh.points.size());
  for (const Vector3d& p : mesh.points) text += fmt::format("v {:f}\n", fmt::join(p, " "));
  for (const auto& [a, b, c] : mesh.triangles) {
    text += fmt::format("f {}/7/8 {}//3 {}\r\n", a + 1, b + 1, c - count);
  }
  return text;
}

std::string AsTextStl(const TriangleMesh& mesh) {
  std::string text = "solid box\n";
  for (const auto& triangle : mesh.triangles) {
    text += "facet normal 0 0 0\n outer loop\n";
    for (const int corner : triangle) {
      const Vector3d& p = mesh.points[corner];
      text += fmt::format("  vertex {:f} {:f} +{:f}\n", p.x(), p.y(), p.z());
    }
    text += " endloop\nendfacet\n";
  }
  return text + "endsolid box\n";
}

std::string AsBinaryStl(const TriangleMesh& mesh) {
  std::string bytes = "solid, but binary";
  bytes.resize(80);
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  for (const auto& triangle : mesh.triangles) {
    std::array<float, 12> values = {};
    for (int k = 0; k < 9; ++k)
      values[3 + k] = static_cast<float>(mesh.points[triangle[k / 3]][k % 3]);
    bytes.append(reinterpret_cast<const char*>(values.data()), sizeof values);
    bytes.append(2, '\0');
  }
  return bytes;
}

TEST_F(MeshFiles, AllTypesAreTheSameSolid) {
  const TriangleMesh mesh = Box({0.5, 1.25, 2.0});  // exact in six decimals and in float
  Write("box.obj", AsObj(mesh));
  Write("text.stl", AsTextStl(mesh));
  Write("binary.STL", AsBinaryStl(mesh));
  const Solid expected = SolidOf(mesh, MeshRule::kEnclosed);
  for (const char* name : {"box.obj", "text.stl", "binary.STL"}) {
    const TriangleMesh read = ReadMesh(model_ / name);
    EXPECT_EQ(read.points.size(), 8u) << name;
    EXPECT_EQ(NumOpenEdges(read), 0u) << name;
    const Solid solid = SolidOf(read, MeshRule::kEnclosed);
    // points in another order: sums of 12 pyramids in another order
    EXPECT_NEAR(solid.volume, expected.volume, 64 * kEps * expected.volume) << name;
    EXPECT_LE((solid.inertia - expected.inertia).norm(), 256 * kEps * expected.inertia.norm());
  }
}

/// Files with own points for each triangle have no open edges either.
TEST_F(MeshFiles, EqualPointsOfObjAreOne) {
  const TriangleMesh mesh = Box({0.5, 1.25, 2.0});
  TriangleMesh split;
  for (const auto& triangle : mesh.triangles) {
    const int first = static_cast<int>(split.points.size());
    for (const int corner : triangle) split.points.push_back(mesh.points[corner]);
    split.triangles.push_back({first, first + 1, first + 2});
  }
  Write("split.obj", AsObj(split));
  EXPECT_EQ(NumOpenEdges(ReadMesh(model_ / "split.obj")), 0u);
}

TEST_F(MeshFiles, FaultsAreNamedWithTheirLine) {
  ExpectFault("a.obj", "v 0 0 0\nv 1 0\n", "a.obj:2: found a point without three numbers");
  ExpectFault("a.obj", "v 0 0 nan\n", "a.obj:1: found a point");
  ExpectFault("a.obj", "v 0 0 0\nf 1 1 2\n",
              "a.obj:2: found the corner '2', expected numbers of points, 1 to 1");
  ExpectFault("a.obj", "v 0 0 0\nf 0 1 1\n", "the corner '0'");
  ExpectFault("a.obj", "v 0 0 0\nf -2 1 1\n", "the corner '-2'");
  ExpectFault("a.obj", "v 0 0 0\nf 99999999999 1 1\n", "the corner '99999999999'");
  ExpectFault("a.obj", "v 0 0 0\nf 1 1\n", "fewer than 3 corners");
  ExpectFault("a.obj", "", "found no triangles");
  ExpectFault("a.stl", "solid x\nvertex 0 0 0\nendloop\n",
              "a.stl:3: found a facet that is no triangle");
  ExpectFault("a.stl", "binary", "found 6 bytes, expected 84 for 0 triangles");
  std::string cut = AsBinaryStl(Box({1, 1, 1}));
  cut.pop_back();
  ExpectFault("a.stl", cut, "found 683 bytes, expected 684 for 12 triangles");
  std::string infinite = AsBinaryStl(Box({1, 1, 1}));
  const float inf = INFINITY;
  std::memcpy(infinite.data() + 84 + 50 + 12, &inf, sizeof inf);
  ExpectFault("a.stl", infinite, "a corner that is not finite in triangle 1");
  ExpectFault("a.dae", "<COLLADA/>", "found a mesh of type '.dae', expected .stl or .obj");
}

TEST_F(MeshFiles, MjcfGeomsTakeTheMassOfTheirMesh) {
  Write("meshes/brick.obj", AsObj(Box({0.5, 1.25, 2.0})));
  const auto model = [](const std::string& asset, const std::string& geom) {
    return "<mujoco><compiler meshdir='meshes'/><default><mesh scale='2 1 1'/></default>\n<asset>" +
           asset + "</asset>\n<worldbody><body><joint/>" + geom + "</body></worldbody></mujoco>";
  };
  // scaled to 1 x 1.25 x 2, its corner at (0, 0, 1), then turned about z by a quarter
  Write("main.xml",
        model("<mesh file='brick.obj' refpos='0 0 -1'/>",
              "<geom type='mesh' mesh='brick' density='10' pos='3 0 0' quat='1 0 0 1'/>"));
  const BodyDescription body = Read().description.bodies.at(1);
  EXPECT_NEAR(body.mass, 25.0, 64 * 25 * kEps);
  ExpectNear(body.com, {3 - 0.625, 0.5, 2}, 64 * kEps);
  const Vector3d moments = 25.0 / 12.0 * Vector3d(1 + 4, 1.5625 + 4, 1 + 1.5625);
  const Matrix3d expected = moments.asDiagonal();
  EXPECT_LE((body.inertia - expected).norm(), 256 * kEps * expected.norm());

  const std::string geom = "<geom type='mesh' mesh='brick' mass='3'/>";
  Write("main.xml",
        model("<mesh name='brick' file='brick.obj' scale='1 -1 1' inertia='exact'/>", geom));
  EXPECT_NEAR(Read().description.bodies.at(1).com.y(), -0.625, 64 * kEps);
  struct Row {
    const char *asset, *words;
  };
  for (const Row& row :
       {Row{"<mesh name='brick' file='none.obj'/>",
            "main.xml:2: <mesh name='brick'> file: found 'none.obj', expected a file that exists"},
        {"<mesh name='brick' file='../../out.obj'/>", "a file below the folder of the main file"},
        {"<mesh name='brick' file='/etc/passwd'/>", "a file below the folder of the main file"},
        {"<mesh name='brick' file='.'/>", "a file that exists"},
        {"<mesh name='brick'/>", "a mesh without points"},
        {"<mesh name='brick' vertex='0 0 0'/>", "vertex: found"},
        {"<mesh name='brick' vertex='0 0 0 1 0 0 0 1 0 1 1 0'/>", "found points in a plane"},
        {"<mesh name='brick' vertex='0 0 0 1 0 0 0 1 0 1 1 0 7'/>", "found 13 numbers"},
        {"<mesh name='brick' vertex='0 0 0 1 0 0 0 1 0 0 0 1' face='0 1 2 0 1 3 0 2 3 1 2 4'/>",
         "found 4 in 'face', expected a point, 0 to 3"},
        {"<mesh name='brick' file='brick.obj' scale='0 1 1'/>", "a mesh of 0 m^3"},
        {"<mesh file='brick.obj'/><mesh file='brick.obj'/>", "a name that no other mesh has"},
        {"", "mesh: found 'brick', expected the name of a mesh"}}) {
    Write("../out.obj", AsObj(Box({1, 1, 1})));
    Write("main.xml", model(row.asset, geom));
    ExpectMessage({row.words});
  }
  // eight corners, two points within and one on a face: their hull is the cuboid of 1 x 2 x 3
  const std::string cuboid =
      "vertex='0 0 0 1 0 0 0 2 0 1 2 0 0.5 1 1 0 0 3 1 0 3 0.25 1.5 2 0 2 3 1 2 3 0.5 0 1.5'";
  Write("meshes/points.obj",
        "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 1 2 0\nv 0.5 1 1\nv 0 0 3\nv 1 0 3\nv 0 2 3\nv 1 2 3\n");
  for (const std::string& points :
       {cuboid, cuboid + " inertia='convex'", cuboid + " inertia='exact'",
        std::string("file='points.obj'")}) {
    Write("main.xml", model("<mesh name='brick' scale='1 1 1' " + points + "/>", geom));
    const BodyDescription made = Read().description.bodies.at(1);
    ExpectNear(made.com, {0.5, 1.0, 1.5}, 64 * kEps);
    const Vector3d wanted = Vector3d(13.0, 10.0, 5.0) / 4.0;  // m/12 (b^2 + c^2)
    EXPECT_LE((made.inertia.diagonal() - wanted).norm(), 64 * kEps * wanted.norm());
  }
  // without a type MuJoCo fits a sphere to the mesh
  Write("main.xml", model("<mesh file='brick.obj'/>", "<geom mesh='brick'/>"));
  ExpectMessage({"a shape is not fitted to it"});
  TriangleMesh open = Box({0.5, 1.25, 2.0});
  open.triangles.pop_back();
  Write("meshes/brick.obj", AsObj(open));
  Write("main.xml", model("<mesh file='brick.obj'/>", geom));
  ExpectNote(Read(), "<mesh>", "not closed at 3 edges");
  Write("main.xml", model("<mesh file='brick.obj' inertia='exact'/>", geom));
  ExpectMessage({"a closed mesh: 3 edges"});
}

TEST_F(MeshFiles, SdfLinksTakeTheMassOfTheirShapes) {
  const auto model = [](const std::string& inside, const std::string& link_pose = "") {
    return "<sdf version='1.11'><model name='m'><frame name='end'><pose>0 0 3 0 0 "
           "1.5707963267948966</pose></frame><link name='arm'>" +
           link_pose + "<inertial auto='true'><density>1200</density></inertial>" + inside +
           "</link><joint name='pin' "
           "type='revolute'><parent>world</parent><child>arm</child><axis><xyz>0 1 "
           "0</xyz></axis></joint></model></sdf>";
  };
  const auto shape = [](const std::string& geometry, const std::string& more = "") {
    return "<collision name='c" + std::to_string(more.size()) + "'>" + more + "<geometry>" +
           geometry + "</geometry></collision>";
  };
  // a beam of 1.92 kg and a bob of 5.02655 kg
  const Imported pendulum =
      ImportOf(model(shape("<box><size>0.04 0.04 1.0</size></box>", "<pose>0 0 -0.5 0 0 0</pose>") +
                     shape("<sphere><radius>0.1</radius></sphere>", "<pose>0 0 -1 0 0 0</pose>")));
  const BodyDescription& body = pendulum.description.bodies.at(1);
  EXPECT_NEAR(body.mass, 6.946548, 1e-6);
  EXPECT_NEAR(body.com.z(), -0.861802, 1e-6);
  EXPECT_NEAR(body.inertia(1, 1), 0.527692, 1e-6);
  // shapes relative to other frames: (0.2, 0, 0) in "end" is (0, 0.2, 3) in the model
  const std::string turned = "<pose>0 0.2 1 1.5707963267948966 0 0</pose>";  // y, z: z, -y
  const BodyDescription placed =
      ImportOf(model(shape("<box><size>0.04 0.04 1.0</size></box>",
                           "<pose relative_to='end'>0.2 0 0 0 0 0</pose>"),
                     turned))
          .description.bodies.at(1);
  EXPECT_LT((placed.com - Eigen::Vector3d(0.0, 2.0, 0.0)).norm(), 1e-14);
  EXPECT_NEAR(placed.inertia(1, 1), 1.92 * 2 * 0.04 * 0.04 / 12, 1e-15);  // along the link's y
  const auto mass_of = [&](const std::string& inside) {
    return ImportOf(model(inside)).description.bodies.at(1).mass;
  };
  EXPECT_NEAR(mass_of(shape("<cylinder><radius>0.1</radius><length>2</length></cylinder>")),
              1200 * pi * 0.02, 1e-12);
  EXPECT_NEAR(mass_of(shape("<capsule><radius>0.1</radius><length>2</length></capsule>",
                            "<density>1</density>")),
              pi * (0.02 + 0.004 / 3.0), 1e-14);
  EXPECT_NEAR(mass_of(shape("<ellipsoid><radii>1 2 3</radii></ellipsoid>")), 1200 * 8 * pi, 1e-10);
  ExpectRefusal(model(shape("<sphere><radius>1</radius></sphere>",
                            "<pose relative_to='ends'>0 0 0 0 0 0</pose>")),
                {"the frame 'ends', which is not there"});
  ExpectRefusal(model(shape("<plane/>")), {"a shape whose volume is not known"});
  ExpectRefusal(model(shape("<sphere><radius>-1</radius></sphere>")), {"<radius>: found '-1'"});
  ExpectRefusal(model(shape("<mesh><uri>a.stl</uri></mesh>")), {"a text has no other files"});
  Write("brick.obj", AsObj(Box({0.5, 1.25, 2.0})));
  Write("m.sdf", model(shape("<mesh><uri>brick.obj</uri><scale>0.1 0.1 0.1</scale></mesh>")));
  EXPECT_NEAR(Read("m.sdf").description.bodies.at(1).mass, 1.5, 1e-13);
}

}  // namespace loopbench::harness::solids_test
