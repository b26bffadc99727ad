#include "lab/evaluation/contacts.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "lab/evaluation/csv_reader.hpp"

namespace kilvo::lab {
namespace contacts_test {

using testing::AllOf;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

constexpr auto ms = [](std::int64_t n) { return time_from_ns(1700000000000000000 + n * 1000000); };

/// Swings of a foot, ms from and to (exclusive); it is down at all other times.
using Swings = std::vector<std::pair<std::int64_t, std::int64_t>>;

/// A sample every `period` ms from `begin` to `end` (exclusive).
std::vector<ContactSample> sampled(const Swings& left, const Swings& right, std::int64_t end, std::int64_t period = 1,
                                   std::int64_t begin = 0) {
  const auto down = [](const Swings& swings, std::int64_t t) {
    return std::none_of(swings.begin(), swings.end(), [t](const auto& swing) { return swing.first <= t && t < swing.second; });
  };
  std::vector<ContactSample> samples;
  for (std::int64_t t = begin; t < end; t += period) samples.push_back({ms(t), {down(left, t), down(right, t)}});
  return samples;
}

// Stand 1 s; left swings 1000-1400, right 1500-1900, left 2000-2400, right 2500-2900; stand to 4000.
// First lift-off: 999.5; last touchdown: 2899.5; samples in between: 1000 to 2899, that is 1900.
const Swings left_truth{{1000, 1400}, {2000, 2400}}, right_truth{{1500, 1900}, {2500, 2900}};
std::vector<ContactSample> truth() { return sampled(left_truth, right_truth, 4000); }

TEST(Contacts, ATransitionLiesBetweenItsSamples) {
  const auto list = stances(sampled({{1000, 1400}}, {}, 2000, 10), left_foot);
  ASSERT_EQ(list.size(), 2);
  EXPECT_FALSE(list[0].begin);
  EXPECT_EQ(list[0].end, ms(995));
  EXPECT_EQ(list[1].begin, ms(1395));
  EXPECT_EQ(list[0].first, ms(0));
  EXPECT_EQ(list[0].last, ms(990));
  EXPECT_EQ(list[1].first, ms(1400));
  EXPECT_EQ(list[1].last, ms(1990));
  EXPECT_FALSE(list[1].end);
}

TEST(Contacts, TheTruthItselfIsPerfect) {
  const ContactEvaluation e = evaluate_contacts(truth(), truth());
  EXPECT_TRUE(e.walks);
  EXPECT_DOUBLE_EQ(to_seconds(e.end - e.begin), 1.9);
  EXPECT_EQ(e.accuracy, 1);
  EXPECT_EQ(e.false_positive_rate, 0.0);
  EXPECT_NEAR(e.coverage, 1, 1e-12);
  for (const FootEvaluation& foot : e.feet) {
    EXPECT_EQ(foot.compared, 1900);
    EXPECT_EQ(foot.true_events, 2);
    EXPECT_EQ(foot.estimated_events, 2);
    EXPECT_EQ(foot.correct, 2);
    EXPECT_THAT(foot.touchdown_errors_ms, ElementsAre(0, 0));
  }
  EXPECT_THAT(e.feet[left_foot].liftoff_errors_ms, ElementsAre(0, 0));
  EXPECT_THAT(e.feet[right_foot].liftoff_errors_ms, ElementsAre(0, 0));
}

// Left touches down 20 ms early and 38 ms late and lifts off 10 ms late at 2000: of its 1900 samples 20 + 38 + 10 = 68 are wrong; of its
// 800 samples in the air 20 + 10 = 30 are reported in contact. Right is perfect.
TEST(Contacts, EarlyAndLateTransitionsCostWhatTheyLast) {
  const ContactEvaluation e = evaluate_contacts(sampled({{1000, 1380}, {2010, 2438}}, right_truth, 4000), truth());
  const FootEvaluation& left = e.feet[left_foot];
  EXPECT_NEAR(left.accuracy, 1 - 68.0 / 1900, 1e-12);
  EXPECT_NEAR(*left.false_positive_rate, 30.0 / 800, 1e-12);
  EXPECT_NEAR(e.accuracy, 1 - 34.0 / 1900, 1e-12);
  EXPECT_NEAR(*e.false_positive_rate, 15.0 / 800, 1e-12);
  EXPECT_EQ(left.correct, 2);
  EXPECT_THAT(left.touchdown_errors_ms, ElementsAre(DoubleNear(-20, 1e-9), DoubleNear(38, 1e-9)));
  EXPECT_THAT(left.liftoff_errors_ms, ElementsAre(DoubleNear(0, 1e-9), DoubleNear(10, 1e-9)));
}

TEST(Contacts, BeforeTheFirstLiftOffAndAfterTheLastTouchdownNothingCounts) {
  const ContactEvaluation e =
      evaluate_contacts(sampled({{100, 800}, {1000, 1400}, {2000, 2400}, {3200, 3900}}, right_truth, 4000), truth());
  EXPECT_EQ(e.accuracy, 1);
  EXPECT_EQ(e.feet[left_foot].estimated_events, 2);
  EXPECT_EQ(e.feet[left_foot].extra, 0);
}

TEST(Contacts, ATouchdownOver100MillisecondsOffIsMissedAndExtra) {
  const ContactEvaluation e = evaluate_contacts(sampled({{1000, 1500}, {2000, 2501}}, right_truth, 4000), truth());
  const FootEvaluation& left = e.feet[left_foot];
  EXPECT_EQ(left.matched, 1);  // exactly 100 ms late
  EXPECT_EQ(left.missed, 1);
  EXPECT_EQ(left.extra, 1);
  EXPECT_EQ(left.correct, 1);
}

TEST(Contacts, AFalseStanceInMidSwingIsExtra) {
  const ContactEvaluation e = evaluate_contacts(sampled({{1000, 1150}, {1200, 1400}, {2000, 2400}}, right_truth, 4000), truth());
  EXPECT_EQ(e.feet[left_foot].correct, 2);
  EXPECT_EQ(e.feet[left_foot].extra, 1);
  EXPECT_EQ(e.feet[left_foot].missed, 0);
  EXPECT_NEAR(*e.feet[left_foot].false_positive_rate, 50.0 / 800, 1e-12);
}

// Left stands from 1400 to 2000, its lift-off begins at 1900.
TEST(Contacts, AGapInMidContactMakesThePhaseWrong) {
  const ContactEvaluation gap = evaluate_contacts(sampled({{1000, 1400}, {1600, 1610}, {2000, 2400}}, right_truth, 4000), truth());
  EXPECT_EQ(gap.feet[left_foot].matched, 2);
  EXPECT_EQ(gap.feet[left_foot].gaps, 1);
  EXPECT_EQ(gap.feet[left_foot].correct, 1);
  EXPECT_EQ(gap.feet[left_foot].extra, 1);
  const ContactEvaluation too_early = evaluate_contacts(sampled({{1000, 1400}, {1890, 2400}}, right_truth, 4000), truth());
  EXPECT_EQ(too_early.feet[left_foot].gaps, 1);
  EXPECT_EQ(too_early.feet[left_foot].extra, 0);
  const ContactEvaluation within = evaluate_contacts(sampled({{1000, 1400}, {1910, 2400}}, right_truth, 4000), truth());
  EXPECT_EQ(within.feet[left_foot].gaps, 0);
  EXPECT_EQ(within.feet[left_foot].correct, 2);
}

TEST(Contacts, ABounceIsMatchedByItsCloserTouchdown) {
  const ContactEvaluation e = evaluate_contacts(sampled({{1000, 1310}, {1340, 1405}, {2000, 2400}}, right_truth, 4000), truth());
  EXPECT_THAT(e.feet[left_foot].touchdown_errors_ms, ElementsAre(DoubleNear(5, 1e-9), DoubleNear(0, 1e-9)));
  EXPECT_EQ(e.feet[left_foot].correct, 2);
  EXPECT_EQ(e.feet[left_foot].extra, 1);
}

TEST(Contacts, EachTouchdownIsMatchedOnce) {
  // One estimated touchdown, 50 ms from both of two true ones.
  const auto real = sampled({{1000, 1400}, {1420, 1500}}, right_truth, 4000);
  const ContactEvaluation e = evaluate_contacts(sampled({{1000, 1450}}, right_truth, 4000), real);
  EXPECT_EQ(e.feet[left_foot].true_events, 2);
  EXPECT_EQ(e.feet[left_foot].matched, 1);
  EXPECT_EQ(e.feet[left_foot].missed, 1);
}

TEST(Contacts, TheTruthMayHaveAnotherRate) {
  const ContactEvaluation slow_truth = evaluate_contacts(truth(), sampled(left_truth, right_truth, 4000, 5, 2));
  EXPECT_GT(slow_truth.accuracy, 1 - 4 * 3.0 / 1900);  // at most half a period at each of four transitions
  EXPECT_EQ(slow_truth.feet[left_foot].correct, 2);
  const ContactEvaluation slow_estimate = evaluate_contacts(sampled(left_truth, right_truth, 4000, 20, 7), truth());
  EXPECT_EQ(slow_estimate.accuracy, 1);
  EXPECT_EQ(slow_estimate.feet[right_foot].compared, 95);
  for (const double error : slow_estimate.feet[right_foot].touchdown_errors_ms) EXPECT_LE(std::abs(error), 10);
}

TEST(Contacts, WhereLegsAreLostNothingIsKnown) {
  auto lost = truth();
  std::erase_if(lost, [](const ContactSample& s) { return s.t >= ms(1700) && s.t < ms(2450); });
  const ContactEvaluation e = evaluate_contacts(lost, truth());
  EXPECT_EQ(e.accuracy, 1);
  EXPECT_NEAR(e.coverage, 1 - 751.0 / 1900, 1e-9);
  EXPECT_EQ(e.feet[left_foot].true_events, 1);  // the one at 2400 is not known
  EXPECT_EQ(e.feet[left_foot].uncovered, 1);
  EXPECT_EQ(e.feet[left_foot].missed, 0);
  EXPECT_EQ(e.feet[right_foot].true_events, 1);
  EXPECT_EQ(e.feet[right_foot].correct, 1);
}

TEST(Contacts, WithoutAStepAllOfTheTruthIsCompared) {
  const auto standing = sampled({}, {}, 1000);
  const ContactEvaluation e = evaluate_contacts(sampled({{500, 600}}, {}, 1000), standing);
  EXPECT_FALSE(e.walks);
  EXPECT_NEAR(e.feet[left_foot].accuracy, 0.9, 1e-12);
  EXPECT_EQ(e.feet[left_foot].extra, 1);
  EXPECT_FALSE(e.false_positive_rate);
  EXPECT_THAT(to_text(e), HasSubstr("false positive rate unknown"));
}

TEST(Contacts, WhatCannotBeComparedSaysWhy) {
  auto later = truth();
  for (ContactSample& s : later) s.t += std::chrono::seconds(100);
  EXPECT_THROW(evaluate_contacts(later, truth()), EvaluationError);
  EXPECT_THROW(evaluate_contacts({}, truth()), EvaluationError);
  EXPECT_THROW(evaluate_contacts(truth(), {}), EvaluationError);
  auto shuffled = truth();
  std::swap(shuffled[5], shuffled[6]);
  EXPECT_THROW(evaluate_contacts(shuffled, truth()), EvaluationError);
}

TEST(Contacts, TheDistributionKeepsEarlyAndLateApart) {
  const TransitionErrors d = distribution({-10, -20, 0, 3, 5, 40});
  EXPECT_EQ(d.n, 6);
  EXPECT_EQ(d.early, 2);
  EXPECT_EQ(d.late, 3);
  EXPECT_DOUBLE_EQ(d.mean_early, -15);
  EXPECT_DOUBLE_EQ(d.mean_late, 16);
  EXPECT_DOUBLE_EQ(d.min, -20);
  EXPECT_DOUBLE_EQ(d.p5, -17.5);
  EXPECT_DOUBLE_EQ(d.p50, 1.5);
  EXPECT_DOUBLE_EQ(d.p95, 31.25);
  EXPECT_DOUBLE_EQ(d.max, 40);
  EXPECT_EQ(distribution({}).n, 0);
}

TEST(Contacts, JsonAndTextSayTheSame) {
  const ContactEvaluation e = evaluate_contacts(sampled({{1000, 1380}, {2010, 2438}}, right_truth, 4000), truth());
  const auto json = nlohmann::json::parse(to_json(e));
  EXPECT_NEAR(json["accuracy"], 1 - 34.0 / 1900, 1e-12);
  EXPECT_EQ(json["left"]["correct"], 2);
  EXPECT_EQ(json["left"]["touchdown_errors_ms"]["early"], 1);
  EXPECT_EQ(json["right"]["liftoff_errors_ms"]["n"], 2);
  EXPECT_THAT(to_text(e),
              AllOf(HasSubstr("accuracy            98.21 % (left 96.42 %, right 100.00 %)"), HasSubstr("2/2 correct of 2/2 true")));
}

TEST(Contacts, FilesAreReadByColumnName) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "contacts_test.csv";
  const auto write = [&](const std::string& text) { std::ofstream(path) << text; };
  write("t,fz_left,right,left\n1700000000.001,157.5,0,1\n1700000000.002,150,1,0\n");
  const auto samples = read_contacts(path);
  ASSERT_EQ(samples.size(), 2);
  EXPECT_EQ(samples[0].t, ms(1));
  EXPECT_THAT(samples[0].down, ElementsAre(true, false));
  EXPECT_THAT(samples[1].down, ElementsAre(false, true));
  for (const char* text : {"t,left\n1,1\n", "t,left,right\n2,1,1\n1,1,1\n", "t,left,right\n1,nan,1\n", "t,left,right\n1,0.5,1\n"}) {
    write(text);
    EXPECT_THROW(read_contacts(path), CsvError) << text;
  }
  std::filesystem::remove(path);
}

}  // namespace contacts_test
}  // namespace kilvo::lab
