#include <gtest/gtest.h>

#include <fstream>

#include "tests/levelset/felt/levelset_felt.h"

namespace nephele::felt {
namespace {

/// A folder to work in, and the way back.
class WorkingFolder {
 public:
  WorkingFolder() : before_(std::filesystem::current_path()) {
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = std::filesystem::temp_directory_path() / ("nephele felt " + name);
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    std::filesystem::current_path(folder_);
  }
  ~WorkingFolder() {
    std::filesystem::current_path(before_);
    std::filesystem::remove_all(folder_);
  }

 private:
  std::filesystem::path before_, folder_;
};

TEST(FeltExamples, OfAllFunctionsRunAlone) {
  const WorkingFolder folder;
  const std::size_t ofModeling = allFunctions().functions().size();
  for (std::size_t i = 0; i < gridFunctions().functions().size(); ++i) {
    const Function& function = gridFunctions().functions()[i];
    EXPECT_TRUE(i < ofModeling || function.example.find(function.name) != std::string::npos)
        << function.signature;
    EXPECT_FALSE(function.text.empty()) << function.signature;
    EXPECT_FALSE(function.group.empty()) << function.signature;
    try {
      Context context;
      Program(function.name, function.example, gridFunctions()).run(context);
    } catch (const Error& error) {
      ADD_FAILURE() << function.signature << "\n" << error.what();
    }
  }
}

TEST(FeltFiles, ReturnWhatWasWritten) {
  const WorkingFolder folder;
  Context context;
  auto values = ran(
      "domain d((-1,-1,-1), (2,2,2), (0,0,0), 0.05, 0.05, 0.05);\nscalarfield ball = sphere((0,0,0), 0.7);\n"
      "write(\"ball.vdb\", ball, d, \"surface\"); scalarfield level = readfield(\"ball.vdb\");\n"
      "write(\"fog.vdb\", identity().x, d); scalarfield fog = readfield(\"fog.vdb\", \"density\");\n"
      "write(\"wind.vdb\", identity(), d); vectorfield wind = readvectorfield(\"wind.vdb\");\n"
      "scalarcache c(d); cachewrite(c, identity().y); write(\"c.vdb\", c, \"height\");\n"
      "scalarfield height = readfield(\"c.vdb\", \"height\");\n"
      "write(\"ball.ply\", setattribute(ls2shape(ball), \"wetness\", identity().z));\n"
      "shape mesh = read(\"ball.ply\"); scalarfield wetness = attribute(mesh, \"wetness\");\n"
      "shape ofLevel = read(\"ball.vdb\"); float side = 100%;",
      &context);
  const auto at = [&](const char* name, const Vec3f& p) { return values[name].as<ScalarField>()(p); };
  EXPECT_NEAR(at("level", {0.6f, 0, 0}), 0.1f, 1e-3f);
  EXPECT_NEAR(at("level", {0.8f, 0, 0}), -0.1f, 1e-3f);
  EXPECT_NEAR(at("fog", {0.33f, 0.2f, 0}), 0.33f, 1e-5f);
  EXPECT_EQ(at("fog", {-0.33f, 0.2f, 0}), 0);
  EXPECT_NEAR(length(values["wind"].as<VectorField>()({0.3f, 0.2f, -0.1f}) - Vec3f(0.3f, 0.2f, -0.1f)), 0,
              1e-5f);
  EXPECT_NEAR(at("height", {0, -0.4f, 0}), -0.4f, 1e-5f);
  EXPECT_NEAR(at("wetness", {0, 0, 0.7f}), 0.7f, 1e-3f);
  const double volume = 4.0 / 3 * double(kPi) * 0.343;
  EXPECT_NEAR(signedVolume(values["mesh"].as<std::shared_ptr<const Shape>>()->mesh), volume, 0.003 * volume);
  EXPECT_NEAR(signedVolume(values["ofLevel"].as<std::shared_ptr<const Shape>>()->mesh), volume,
              0.01 * volume);
  EXPECT_NEAR(values["side"].as<double>(), 1.4, 2e-3);
}

TEST(FeltFiles, AreRefusedBeforeWorkBegins) {
  const WorkingFolder folder;
  EXPECT_EQ(refusal("shape s = read(\"none.obj\");"),
            "s.felt:1:11: error: none.obj: cannot be read: No such file or directory\n  shape s = "
            "read(\"none.obj\");\n"
            "            ^~~~~~~~~~~~~~~~");
  ran("write(\"ball.obj\", ls2shape(sphere((0,0,0), 1), 16));");
  std::filesystem::create_symlink("ball.obj", "link.obj");
  for (const std::string name : {"./ball.obj", "link.obj"}) {
    const std::string said = refusal("shape s = read(\"ball.obj\");\nwrite(\"" + name + "\", s);");
    const std::string mark(11 + name.size(), '~');
    EXPECT_EQ(said, "s.felt:2:1: error: \"" + name + "\" is a file that the script has read\n  write(\"" +
                        name + "\", s);\n  ^" + mark +
                        "\n  hint: write to another file: what was read stays as it is");
  }
  EXPECT_EQ(refusal("write(\"ball.txt\", ls2shape(sphere((0,0,0), 1), 16));"),
            "s.felt:1:1: error: \"ball.txt\" must end with .obj, .ply, .stl\n"
            "  write(\"ball.txt\", ls2shape(sphere((0,0,0), 1), 16));\n"
            "  ^~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~");
  EXPECT_NE(refusal("write(\"no/fog.vdb\", 1, domain((0,0,0), (1,1,1), 0.1));")
                .find("the folder no does not exist"),
            std::string::npos);
  EXPECT_NE(refusal("write(\"a.vdb\", log(identity().x), domain((-1,0,0), (2,1,1), 0.1), \"t\");")
                .find("not finite"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists("a.vdb"));
}

}  // namespace
}  // namespace nephele::felt
