#include "lab/mapping/ply.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <sstream>

namespace kilvo::lab {
namespace ply_test {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Ply : public ::testing::Test {
 protected:
  Ply() : folder(fs::path(::testing::TempDir()) / ("kilvo_ply_" + std::to_string(std::random_device{}()))) {
    fs::create_directories(folder);
  }
  ~Ply() override { fs::remove_all(folder); }

  std::string bytes(const char* name) const {
    std::ostringstream text;
    text << std::ifstream(folder / name, std::ios::binary).rdbuf();
    return text.str();
  }
  std::size_t files() const { return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {})); }

  fs::path folder;
};

MapBuilder some_map(unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-3, 3);
  std::vector<Eigen::Vector4f> points(30000);
  for (auto& p : points) p = {uniform(random), uniform(random), uniform(random), 40 * uniform(random)};
  MapBuilder map;
  map.add(points);
  return map;
}

std::string error_of(const fs::path& path, const MapBuilder& map) {
  try {
    write_ply(path, map);
  } catch (const OutputError& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(Ply, ReadsBackWhatTheMapHolds) {
  const MapBuilder map = some_map();
  write_ply(folder / "map.ply", map);
  const auto points = read_ply(folder / "map.ply");
  ASSERT_EQ(points.size(), map.size());
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_EQ(points[i], map.point(i));
}

TEST_F(Ply, HasTheHeaderThatViewersExpectAndSixteenBytesPerPoint) {
  MapBuilder map;
  map.add(std::vector<Eigen::Vector4f>{{1, 2, 3, 4}, {5, 6, 7, 8}});
  write_ply(folder / "map.ply", map);
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment KILVO map: metres, world frame\nelement vertex 2\n"
      "property float x\nproperty float y\nproperty float z\nproperty float intensity\nend_header\n";
  EXPECT_EQ(bytes("map.ply").substr(0, header.size()), header);
  EXPECT_EQ(bytes("map.ply").size(), header.size() + 32);
}

TEST_F(Ply, AnEmptyMapIsAFileWithoutPoints) {
  write_ply(folder / "map.ply", MapBuilder());
  EXPECT_TRUE(read_ply(folder / "map.ply").empty());
}

TEST_F(Ply, TheSameInputGivesTheSameBytes) {
  write_ply(folder / "a.ply", some_map());
  write_ply(folder / "b.ply", some_map());
  write_ply(folder / "c.ply", some_map(2));
  EXPECT_EQ(bytes("a.ply"), bytes("b.ply"));
  EXPECT_NE(bytes("a.ply"), bytes("c.ply"));
}

TEST_F(Ply, HasColourOnlyWhereAnImageSawSomethingAndGreyElsewhere) {
  MapBuilder map;
  map.add(std::vector<Eigen::Vector4f>{{1, 2, 3, 0}, {5, 6, 7, 40}, {8, 9, 10, 80}});
  map.colour(std::vector<ColouredPoint>{{{5, 6, 7}, {200, 100, 0}, 1}});
  write_ply(folder / "map.ply", map);
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment KILVO map: metres, world frame\ncomment grey: not seen by the camera\n"
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float intensity\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  EXPECT_EQ(bytes("map.ply").substr(0, header.size()), header);
  EXPECT_EQ(bytes("map.ply").size(), header.size() + 3 * 19);
  const Cloud cloud = read_cloud(folder / "map.ply");
  EXPECT_EQ(cloud.rgb, (std::vector<std::array<std::uint8_t, 3>>{{50, 50, 50}, {200, 100, 0}, {200, 200, 200}}));
  EXPECT_EQ(cloud.intensity, (std::vector<float>{0, 40, 80}));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(cloud.points_W[i], map.point(i).head<3>());
}

TEST_F(Ply, AColouredMapIsTheSameBytesWhereverItIsWritten) {
  MapBuilder map = some_map();
  std::vector<ColouredPoint> colours;
  for (std::size_t i = 0; i < map.size(); i += 3) colours.push_back({map.point(i).head<3>(), {static_cast<std::uint8_t>(i), 1, 2}, 1});
  map.colour(colours);
  write_ply(folder / "a.ply", map);
  write_ply(folder / "b.ply", map);
  EXPECT_EQ(bytes("a.ply"), bytes("b.ply"));
  const Cloud cloud = read_cloud(folder / "a.ply");
  ASSERT_EQ(cloud.rgb.size(), map.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto colour = map.colour_of(i);
    const auto& rgb = cloud.rgb[i];
    ASSERT_TRUE(colour ? rgb == *colour : rgb[0] == rgb[1] && rgb[1] == rgb[2]) << i;
  }
}

TEST_F(Ply, IntensitiesThatAreAllTheSameAreAMiddleGrey) {
  MapBuilder map;
  map.add(std::vector<Eigen::Vector4f>{{1, 2, 3, 9}, {5, 6, 7, 9}});
  map.colour(std::vector<ColouredPoint>{{{5, 6, 7}, {1, 2, 3}, 1}});
  write_ply(folder / "map.ply", map);
  EXPECT_EQ(read_cloud(folder / "map.ply").rgb.front(), (std::array<std::uint8_t, 3>{125, 125, 125}));
}

TEST_F(Ply, ReplacesAnOlderMapAndLeavesNothingBeside) {
  std::ofstream(folder / "map.ply") << "old";
  write_ply(folder / "map.ply", some_map());
  EXPECT_EQ(files(), 1u);
  EXPECT_EQ(read_ply(folder / "map.ply").size(), some_map().size());
}

TEST_F(Ply, FollowsALinkInsteadOfReplacingIt) {
  std::ofstream(folder / "real.ply") << "old";
  fs::create_symlink("real.ply", folder / "link.ply");
  write_ply(folder / "link.ply", some_map());
  EXPECT_TRUE(fs::is_symlink(folder / "link.ply"));
  EXPECT_EQ(read_ply(folder / "real.ply").size(), some_map().size());
}

TEST_F(Ply, AnUnwritablePathIsAnErrorThatNamesIt) {
  const auto missing = folder / "missing" / "map.ply";
  EXPECT_EQ(error_of(missing, some_map()), "cannot write " + missing.string() + ": No such file or directory");
  EXPECT_THAT(error_of(folder, some_map()), HasSubstr(folder.string() + ": Is a directory"));
}

TEST_F(Ply, ADeviceIsWrittenToAndNeverReplaced) {
  EXPECT_EQ(error_of("/dev/null", some_map()), "no error");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(error_of("/dev/full", some_map()), "cannot write /dev/full: No space left on device");
}

TEST_F(Ply, ReadsAFileWithColourAndAnotherOrder) {
  std::ofstream out(folder / "other.ply", std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float z\nproperty uchar red\nproperty float x\nproperty float "
         "y\n"
         "end_header\n";
  const float z = 3, x = 1, y = 2;
  out.write(reinterpret_cast<const char*>(&z), 4)
      .put('r')
      .write(reinterpret_cast<const char*>(&x), 4)
      .write(reinterpret_cast<const char*>(&y), 4);
  out.close();
  EXPECT_EQ(read_ply(folder / "other.ply"), (std::vector<Eigen::Vector4f>{{1, 2, 3, 0}}));
}

TEST_F(Ply, ACloudHasColourAndIntensityOnlyWhenItsFileHas) {
  std::ofstream out(folder / "colour.ply", std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty uchar red\nproperty float x\nproperty float y\n"
         "property float z\nproperty uchar green\nproperty uchar blue\nend_header\n";
  const float xyz[] = {1, 2, 3};
  for (const char* rgb : {"abc", "def"}) out.put(rgb[0]).write(reinterpret_cast<const char*>(xyz), 12).write(rgb + 1, 2);
  out.close();
  const Cloud cloud = read_cloud(folder / "colour.ply");
  EXPECT_EQ(cloud.points_W, (std::vector<Eigen::Vector3f>{{1, 2, 3}, {1, 2, 3}}));
  EXPECT_EQ(cloud.rgb, (std::vector<std::array<std::uint8_t, 3>>{{'a', 'b', 'c'}, {'d', 'e', 'f'}}));
  EXPECT_TRUE(cloud.intensity.empty());
  write_ply(folder / "map.ply", some_map());
  EXPECT_TRUE(read_cloud(folder / "map.ply").rgb.empty());
  EXPECT_EQ(read_cloud(folder / "map.ply").intensity.size(), some_map().size());
}

TEST_F(Ply, RefusesAFileThatIsNoneOrEndsEarly) {
  write_ply(folder / "map.ply", some_map());
  fs::resize_file(folder / "map.ply", 1000);
  EXPECT_THROW(read_ply(folder / "map.ply"), PlyError);
  std::ofstream(folder / "text.ply") << "hello\n";
  EXPECT_THROW(read_ply(folder / "text.ply"), PlyError);
  std::ofstream(folder / "endless.ply") << "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n";
  EXPECT_THROW(read_ply(folder / "endless.ply"), PlyError);
  EXPECT_THROW(read_ply(folder / "none.ply"), PlyError);
}

TEST_F(Ply, ATurnedMapIsTheSameMapTurned) {
  const SO3 turn = SO3::Exp(Eigen::Vector3d(0, 0, M_PI / 2));
  write_ply(folder / "as_is.ply", some_map());
  write_ply(folder / "turned.ply", some_map(), turn);
  const auto before = read_ply(folder / "as_is.ply"), after = read_ply(folder / "turned.ply");
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_NEAR(after[i].x(), -before[i].y(), 1e-4);
    EXPECT_NEAR(after[i].y(), before[i].x(), 1e-4);
    EXPECT_EQ(after[i][3], before[i][3]);
  }
}

}  // namespace ply_test
}  // namespace kilvo::lab
