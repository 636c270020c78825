// Configurations from file to results: norms, orders, expectations, errors, and every config of the repository.
#include "experiments/experiment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "experiments/expectations.hpp"
#include "framework/error.hpp"
#include "support/file_test.hpp"
#include "support/message_of.hpp"

namespace halfgrad {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(FittedOrder, FindsThePowerOfH) {
  const std::vector<double> h = {0.4, 0.2, 0.1};
  std::vector<double> errors;
  for (double x : h) errors.push_back(7 * x * x * x);
  EXPECT_NEAR(*fitted_order(h, errors), 3, 1e-12);
  EXPECT_FALSE(fitted_order(std::vector<double>{0.1}, std::vector<double>{1}));
  EXPECT_FALSE(fitted_order(h, std::vector<double>{0, 0, 1}));
}

TEST(RegionErrors, SplitByPlaceAndLeaveOutPointsThatAreNowhere) {
  Points measured(4, 2), truth = Points::Zero(4, 2);
  measured << 3, 4, 0, 1, 0, 2, NAN, NAN;
  const std::vector<PointPlace> places = {PointPlace::interior, PointPlace::boundary, PointPlace::boundary,
                                          PointPlace::nowhere};
  const auto errors = region_errors(measured, truth, places);
  EXPECT_EQ(errors[0].points, 3);
  EXPECT_EQ(errors[1].points, 1);
  EXPECT_DOUBLE_EQ(errors[1].rms, 5);
  EXPECT_DOUBLE_EQ(errors[2].max, 2);
  EXPECT_DOUBLE_EQ(errors[2].rms, std::sqrt(2.5));
}

std::vector<ResultRow> two_levels() {
  std::vector<ResultRow> rows;
  for (int level = 0; level < 2; ++level)
    for (const char* interpolant : {"linear", "phong"}) {
      ResultRow row;
      row.level = level;
      row.h = level == 0 ? 0.2 : 0.1;
      row.interpolant = interpolant;
      if (row.interpolant == "phong") {
        row.reconstructor = "kriging";
        row.options = R"({"drift":"quadratic","patch":"lean"})";
      }
      const double error = std::pow(row.h, row.interpolant == "phong" ? 3 : 2);
      row.error[0] = {error, error, 10};
      row.gain_over_linear[0] = row.h * row.h / error;
      rows.push_back(row);
    }
  return rows;
}

std::vector<ResultExpectation> check(const char* text) {
  const std::vector<ResultRow> rows = two_levels();
  return check_expectations(read_expectations(json::parse(text), "/expect"), rows, orders_of(rows));
}

TEST(Expectations, HoldOrFailByWhatWasMeasured) {
  const auto held = check(R"([{"interpolant": "phong", "order_at_least": 2.9, "order_at_most": 3.1}])");
  ASSERT_EQ(held.size(), 2u);
  EXPECT_TRUE(held[0].holds && held[1].holds);
  EXPECT_NEAR(held[0].measured, 3, 1e-12);
  EXPECT_FALSE(check(R"([{"interpolant": "linear", "order_at_least": 2.5}])")[0].holds);
  // Without a selector the least favourable match counts.
  EXPECT_NEAR(check(R"([{"order_at_least": 1}])")[0].measured, 2, 1e-12);
  EXPECT_NEAR(check(R"([{"interpolant": "phong", "gain_at_least": 1}])")[0].measured, 10, 1e-9);
  EXPECT_NEAR(check(R"([{"interpolant": "phong", "level": 0, "gain_at_least": 1}])")[0].measured, 5, 1e-9);
  EXPECT_NEAR(check(R"([{"interpolant": "phong", "level": "all", "gain_at_least": 1}])")[0].measured, 5, 1e-9);
  EXPECT_TRUE(check(R"([{"options": {"patch": "lean"}, "norm": "max", "error_at_most": 0.0011}])")[0].holds);
}

TEST(Expectations, RefuseWhatMatchesNothingAndWhatBoundsNothing) {
  EXPECT_THAT(message_of([] { check(R"([{"reconstructor": "knn", "order_at_least": 1}])"); }),
              HasSubstr("matches no result"));
  EXPECT_THAT(message_of([] { check(R"([{"options": {"patch": "wide"}, "order_at_least": 1}])"); }),
              HasSubstr("matches no result"));
  EXPECT_THAT(message_of([] { check(R"([{"interpolant": "phong"}])"); }), HasSubstr("/expect/0: no bound"));
  EXPECT_THAT(message_of([] { check(R"([{"interpolant": "phong", "order_atleast": 2}])"); }),
              HasSubstr("did you mean \"order_at_least\""));
}

class Run : public FileTest {
 protected:
  fs::path config(const json& changes) const {
    json document = json::parse(R"({
      "mesh": {"lattice": {"element": "triangle", "cells": 4}, "refinements": 2},
      "points": {"random": {"count": 200}},
      "field": "radial_twist"})");
    document.merge_patch(changes);
    std::ofstream(folder_ / "test.json") << document;
    return folder_ / "test.json";
  }
  std::string refusal(const char* changes) const {
    return message_of([&] { run_experiment(config(json::parse(changes)), {.check_only = true}); });
  }
};

TEST_F(Run, WritesResultsWithTheContractsFields) {
  const ExperimentResult result = run_experiment(
      config({{"expect", json::parse(R"([{"interpolant": "phong", "region": "interior", "gain_at_least": 2}])")},
              {"outputs", {"json", "csv", "vtu"}}}),
      {.out_directory = folder_ / "out"});
  EXPECT_TRUE(result.all_expectations_hold()) << summary_table(result);
  const json document = json::parse(std::ifstream(folder_ / "out/results.json"));
  for (const char* key : {"name", "version", "config", "machine", "rows", "orders", "expect"})
    EXPECT_TRUE(document.contains(key)) << key;
  ASSERT_EQ(document["rows"].size(), 4u);  // two levels, linear and phong
  for (const json& row : document["rows"]) {
    for (const char* key : {"level", "element", "vertices", "cells", "h", "points", "frame", "interpolant", "alpha",
                            "reconstructor", "options", "error", "gain_over_linear", "weights", "seconds", "skipped"})
      EXPECT_TRUE(row.contains(key)) << key;
    EXPECT_EQ(row["error"]["interior"]["points"].get<int>() + row["error"]["boundary"]["points"].get<int>(), 200);
    EXPECT_GE(row["weights"]["max_abs_sum"].get<double>(), 1 - 1e-12);
  }
  // Bit for bit.
  EXPECT_EQ(document["rows"][1]["error"]["all"]["rms"].get<double>(), result.rows[1].error[0].rms);
  // Every default is filled in.
  EXPECT_EQ(document["config"]["reconstructors"][0]["chandrashekar_garg"]["epsilon"], 1);
  EXPECT_EQ(document["config"]["mesh"]["lattice"]["pattern"], "kuhn");
  EXPECT_TRUE(fs::exists(folder_ / "out/results.csv"));
  EXPECT_TRUE(fs::exists(folder_ / "out/stencils.vtu"));
  EXPECT_TRUE(fs::exists(folder_ / "out/errors.vtp"));
  EXPECT_THAT(summary_table(result), HasSubstr("phong + chandrashekar_garg (epsilon 1"));
}

TEST_F(Run, OverridesAndReductionApplyInOrder) {
  const fs::path path = config(json::parse(R"({"reduced": {"mesh": {"refinements": 1}, "seed": 5}})"));
  const auto resolved = [&](const RunOptions& options) { return json::parse(run_experiment(path, options).config); };
  EXPECT_EQ(resolved({.check_only = true})["mesh"]["refinements"], 2);
  const json both = resolved({.overrides = {"/seed=9", "/name=renamed"}, .reduced = true, .check_only = true});
  EXPECT_EQ(both["mesh"]["refinements"], 1);
  EXPECT_EQ(both["seed"], 9);
  EXPECT_EQ(both["name"], "renamed");
}

TEST_F(Run, RefusesMistakesByPointerAndSuggestion) {
  EXPECT_THAT(refusal(R"({"feild": 1})"), AllOf(HasSubstr("/feild"), HasSubstr("did you mean \"field\"")));
  EXPECT_THAT(refusal(R"({"mesh": {"lattice": {"jiter": 0.2}}})"),
              AllOf(HasSubstr("/mesh/lattice/jiter"), HasSubstr("\"jitter\"")));
  EXPECT_THAT(refusal(R"({"points": {"random": {"count": -1}}})"), HasSubstr("/points/random/count"));
  EXPECT_THAT(refusal(R"({"interpolants": ["phnog"]})"), HasSubstr("did you mean \"phong\""));
  EXPECT_THAT(refusal(R"({"reconstructors": [{"knn": {"kk": 3}}]})"), HasSubstr("/reconstructors/0/knn/kk"));
  EXPECT_THAT(refusal(R"({"outputs": ["htm"]})"), AllOf(HasSubstr("/outputs/0"), HasSubstr("json, csv, html, vtu")));
  EXPECT_THAT(refusal(R"({"mesh": {"lattice": null, "file": "none.msh"}})"), HasSubstr("does not exist"));
  EXPECT_THAT(refusal(R"({"mesh": {"file": "none.msh"}})"), HasSubstr("/mesh"));
  EXPECT_THAT(refusal(R"({"timing": {"repetitions": 0}})"), HasSubstr("/timing/repetitions"));
  EXPECT_THAT(message_of([&] { run_experiment(config({}), {.overrides = {"seed=1"}, .check_only = true}); }),
              HasSubstr("/json/pointer=VALUE"));
  EXPECT_THAT(message_of([&] { run_experiment(folder_ / "absent.json"); }), HasSubstr("absent.json"));
}

TEST_F(Run, ExactGradientsReproduceQuadratics) {
  const ExperimentResult result = run_experiment(config(json::parse(R"({
    "mesh": {"lattice": {"jitter": 0.3}, "refinements": 1}, "field": {"polynomial": {"degree": 2}},
    "reconstructors": ["exact"]})")));
  ASSERT_EQ(result.rows.size(), 2u);
  EXPECT_GT(result.rows[0].error[0].max, 1e-3);
  EXPECT_LT(result.rows[1].error[0].max, 1e-14);
}

TEST_F(Run, HoldsOutVerticesAndRecommends) {
  const ExperimentResult result = run_experiment(config(json::parse(R"({
    "mesh": {"lattice": {"cells": 8, "jitter": 0.2}, "refinements": 1}, "points": null, "hold_out": {"folds": 2},
    "reconstructors": ["chandrashekar_garg", "kriging", "adaptive"]})")),
                                                 {.out_directory = folder_ / "out"});
  ASSERT_TRUE(result.recommendation);
  EXPECT_EQ(result.rows.size(), 4u);
  EXPECT_TRUE(result.orders.empty());
  EXPECT_EQ(result.recommendation->points, result.rows[0].points);
  const json document = json::parse(std::ifstream(folder_ / "out/results.json"));
  EXPECT_EQ(document["recommendation"]["interpolant"], result.recommendation->chosen.interpolant);
  EXPECT_THAT(summary_table(result), HasSubstr("recommended: phong + "));

  EXPECT_THAT(refusal(R"({"hold_out": {}})"), HasSubstr("/points"));
  EXPECT_THAT(refusal(R"({"points": null, "hold_out": {}})"), HasSubstr("/hold_out: found 2 levels"));
  EXPECT_THAT(refusal(R"({"points": null, "mesh": {"refinements": 1}, "hold_out": {"fold": 2}})"),
              HasSubstr("did you mean \"folds\""));
}

// Every configuration that needs no files runs reduced and meets what it expects.
class Config : public testing::TestWithParam<std::string> {};

TEST_P(Config, RunsReducedAndMeetsItsExpectations) {
  const ExperimentResult result =
      run_experiment(fs::path(HALFGRAD_CONFIGS) / (GetParam() + ".json"), {.reduced = true});
  EXPECT_FALSE(result.expectations.empty());
  EXPECT_TRUE(result.all_expectations_hold()) << summary_table(result);
}

std::vector<std::string> config_names() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(HALFGRAD_CONFIGS))
    if (entry.path().extension() == ".json" && !entry.path().stem().string().ends_with("_files"))
      names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

INSTANTIATE_TEST_SUITE_P(Repository, Config, testing::ValuesIn(config_names()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace halfgrad
