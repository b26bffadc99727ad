// The same walk as a ROS 1 bag, as MCAP and as rosbag2: the same results, byte for byte.
#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace formats_test {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Formats : public Story {
 protected:
  Finished run_on(const std::vector<std::string>& inputs, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"run"};
    words.insert(words.end(), inputs.begin(), inputs.end());
    for (const std::string& word : {std::string("--config"), config(), std::string("--out"), out(), std::string("--quiet")})
      words.push_back(word);
    words.insert(words.end(), more.begin(), more.end());
    return kilvo(words);
  }
  Finished convert(const std::vector<std::string>& words) const {
    std::vector<std::string> all{"convert", "--quiet", recording()};
    all.insert(all.end(), words.begin(), words.end());
    return kilvo(all);
  }
  /// What a run writes, but for the times that it took.
  std::map<std::string, std::string> results() const {
    std::map<std::string, std::string> all;
    for (const char* name : {"odometry.tum", "sweeps.tum", "states.csv", "modality.csv", "events.csv", "map.ply"})
      all[name] = read_text(out() + "/" + name);
    return all;
  }
};

TEST_F(Formats, GiveTheSameResults) {
  record(small_walk(2.5).measurements);
  ASSERT_EQ(run_on({recording()}).code, 0);
  const auto expected = results();
  ASSERT_GT(expected.at("odometry.tum").size(), 10000U);
  const std::vector<std::vector<std::string>> conversions{{folder / "walk.mcap"},
                                                          {folder / "folder", "--storage", "sqlite3", "--split", "0.7"},
                                                          {folder / "packed.db3", "--compression", "message"},
                                                          {folder / "mcaps", "--compression", "lz4", "--split", "1"}};
  for (const auto& conversion : conversions) {
    const Finished made = convert(conversion);
    ASSERT_EQ(made.code, 0) << made.err;
    const Finished f = run_on({conversion.front()});
    ASSERT_EQ(f.code, 0) << f.err;
    EXPECT_TRUE(results() == expected) << conversion.front();
  }
  // And back.
  ASSERT_EQ(kilvo({"convert", "--quiet", folder / "walk.mcap", folder / "back.bag"}).code, 0);
  ASSERT_EQ(run_on({folder / "back.bag"}).code, 0);
  EXPECT_TRUE(results() == expected);
}

TEST_F(Formats, SeveralFilesAreOneRecording) {
  record(small_walk(2.5).measurements);
  ASSERT_EQ(run_on({recording()}).code, 0);
  const auto expected = results();
  ASSERT_EQ(convert({folder / "imu.mcap", "--topics", "/imu"}).code, 0);
  ASSERT_EQ(convert({folder / "points.db3", "--topics", "/points"}).code, 0);
  const Finished f = run_on({folder / "imu.mcap", folder / "points.db3"});
  ASSERT_EQ(f.code, 0) << f.err;
  EXPECT_EQ(results().at("sweeps.tum").size(), expected.at("sweeps.tum").size());
}

TEST_F(Formats, InfoNamesTheFormatAndTheTopics) {
  record(small_walk(1.5).measurements);
  ASSERT_EQ(convert({folder / "walk.mcap"}).code, 0);
  const Finished f = kilvo({"info", folder / "walk.mcap", "--config", config()});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.out, HasSubstr("MCAP"));
  EXPECT_THAT(f.out, HasSubstr("(zstd)"));
  EXPECT_THAT(f.out, HasSubstr("/points"));
  EXPECT_THAT(f.out, HasSubstr("timestamp (float64): nanoseconds, absolute"));
}

TEST_F(Formats, ATruncatedMcapIsRunAsFarAsItIsGood) {
  record(small_walk(3).measurements);
  ASSERT_EQ(convert({folder / "walk.mcap", "--compression", "none"}).code, 0);
  fs::resize_file(folder / "walk.mcap", fs::file_size(folder / "walk.mcap") * 3 / 4);
  const Finished f = run_on({folder / "walk.mcap"});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("damaged at byte"));
  EXPECT_EQ(summary()["input_damaged"], true);
}

TEST_F(Formats, ConvertRefusesWhatMakesNoSense) {
  record(small_walk(1).measurements);
  EXPECT_EQ(kilvo({"convert", recording()}).code, 2);
  EXPECT_EQ(kilvo({"convert", recording(), recording()}).code, 2);
  EXPECT_EQ(kilvo({"convert", recording(), folder / "x.bag", "--compression", "zstd"}).code, 2);
  EXPECT_EQ(kilvo({"convert", recording(), folder / "x.mcap", "--split", "1"}).code, 2);
  EXPECT_EQ(kilvo({"convert", folder / "nothing.bag", folder / "x.mcap"}).code, 3);
  const auto refused = [&](const std::vector<std::string>& words, int code, const std::string& text) {
    const Finished f = convert(words);
    EXPECT_EQ(f.code, code) << f.err;
    EXPECT_THAT(f.err, HasSubstr(text));
    EXPECT_FALSE(fs::exists(words.front()));
  };
  refused({folder / "x.txt"}, 2, "no format is called .txt (.bag, .mcap, .db3)");
  refused({folder / "x.mcap", "--topics", "/imu,/nope"}, 3, "no topic /nope, nearest is");
  refused({folder / "x.mcap", "--start", "50"}, 3, "before --start 50");
  write_text(folder / "there.mcap", "mine");
  EXPECT_EQ(convert({folder / "there.mcap"}).code, 2);
  EXPECT_EQ(read_text(folder / "there.mcap"), "mine");
}

TEST_F(Formats, TheLogOfARunIsAnMcapFile) {
  record(small_walk(2).measurements);
  ASSERT_EQ(run_on({recording()}, {"--mcap"}).code, 0);
  const Finished f = kilvo({"info", out() + "/run.mcap"});
  EXPECT_EQ(f.code, 0) << f.err;
  for (const char* topic : {"/kilvo/odometry", "/tf", "/kilvo/cloud", "/kilvo/modality", "/kilvo/timing"})
    EXPECT_THAT(f.out, HasSubstr(topic));
  const Finished again = run_on({recording()});
  ASSERT_EQ(again.code, 0);
  EXPECT_FALSE(fs::exists(out() + "/run.mcap")) << "that of the run before would be wrong";
}

}  // namespace formats_test
}  // namespace kilvo::stories
