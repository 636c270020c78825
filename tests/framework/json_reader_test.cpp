// Configurations are read strictly: what is wrong is named with its place, and every default is recorded.
#include "framework/json_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "support/message_of.hpp"

namespace halfgrad {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

TEST(JsonReader, ValuesHaveTheirTypeAndErrorsTheirPlace) {
  const json object = {{"number", 0.5}, {"count", 3}, {"flag", true}, {"word", "wide"}, {"nothing", nullptr}};
  JsonReader reader(object, "/a/0");
  EXPECT_EQ(reader.number("number"), 0.5);
  EXPECT_EQ(reader.number("count"), 3);
  EXPECT_EQ(reader.integer("count"), 3);
  EXPECT_TRUE(reader.boolean("flag", false));
  EXPECT_EQ(reader.text("word"), "wide");
  EXPECT_EQ(reader.choice("word", {"lean", "wide"}, "lean"), "wide");
  EXPECT_THAT(message_of([&] { reader.number("word"); }),
              AllOf(HasSubstr("/a/0/word"), HasSubstr("\"wide\""), HasSubstr("finite number")));
  EXPECT_THAT(message_of([&] { reader.number("nothing"); }), AllOf(HasSubstr("/a/0/nothing"), HasSubstr("null")));
  EXPECT_THAT(message_of([&] { reader.integer("number"); }), AllOf(HasSubstr("/a/0/number"), HasSubstr("0.5")));
  EXPECT_THAT(message_of([&] { reader.boolean("count", true); }), HasSubstr("true or false"));
  EXPECT_THAT(message_of([&] { reader.text("count"); }), AllOf(HasSubstr("/a/0/count"), HasSubstr("a string")));
  EXPECT_THAT(message_of([&] { reader.number("absent"); }), HasSubstr("/a/0/absent: missing"));
  EXPECT_THAT(message_of([&] {
                reader.choice("word", {"lean", "widest"}, "lean");
              }),
              AllOf(HasSubstr("lean, widest"), HasSubstr("did you mean \"widest\"?")));
}

TEST(JsonReader, NumbersAreFinite) {
  const json object = {{"x", std::numeric_limits<double>::infinity()}};
  JsonReader reader(object, "");
  EXPECT_THAT(message_of([&] { reader.number("x"); }), HasSubstr("/x"));
}

TEST(JsonReader, DefaultsAreRecordedBesideWhatWasGiven) {
  const json object = {{"given", 2}};
  JsonReader reader(object, "");
  EXPECT_EQ(reader.integer("given", 7), 2);
  EXPECT_EQ(reader.integer("count", 7), 7);
  EXPECT_EQ(reader.number("number", 0.25), 0.25);
  EXPECT_FALSE(reader.boolean("flag", false));
  EXPECT_EQ(reader.text("word", "wide"), "wide");
  EXPECT_EQ(reader.choice("kind", {"a", "b"}, "b"), "b");
  reader.finish();
  EXPECT_EQ(reader.resolved(),
            json({{"given", 2}, {"count", 7}, {"number", 0.25}, {"flag", false}, {"word", "wide"}, {"kind", "b"}}));
}

TEST(JsonReader, KeysThatNobodyAskedForAreRefused) {
  const json object = {{"radus", 2}};
  JsonReader reader(object, "/rule");
  reader.number("radius", 1);
  reader.number("height", 1);
  EXPECT_THAT(message_of([&] { reader.finish(); }),
              AllOf(HasSubstr("/rule/radus"), HasSubstr("radius, height"), HasSubstr("did you mean \"radius\"?")));
  JsonReader unasked(object, "/rule");
  EXPECT_THAT(message_of([&] { unasked.finish(); }), HasSubstr("none"));
}

TEST(JsonReader, OnlyObjectsAreRead) {
  const json list = json::array({1}), object = json::object();
  EXPECT_THAT(message_of([&] { JsonReader(list, "/a"); }), AllOf(HasSubstr("/a"), HasSubstr("an object")));
  EXPECT_THAT(message_of([&] { JsonReader(list, ""); }), HasSubstr("the document"));
  EXPECT_EQ(message_of([&] { JsonReader(object, "/a").finish(); }), "no error");
}

TEST(JsonReader, AChoiceIsANameOrANameWithItsOptions) {
  const json name = "kriging", with_options = {{"kriging", {{"drift", "cubic"}}}}, unknown = "krigin",
             two = {{"kriging", 1}, {"knn", 2}}, number = 3;
  const auto read = [](const json& value, const char* pointer) {
    return read_named_options(value, pointer, "reconstructor", {"kriging", "knn"});
  };
  EXPECT_EQ(read(name, "/r").name, "kriging");
  EXPECT_TRUE(read(name, "/r").options->empty());
  EXPECT_EQ(read(with_options, "/r").pointer, "/r/kriging");
  EXPECT_EQ((*read(with_options, "/r").options)["drift"], "cubic");
  EXPECT_THAT(message_of([&] { read(unknown, "/r"); }),
              AllOf(HasSubstr("/r"), HasSubstr("no reconstructor \"krigin\""), HasSubstr("did you mean \"kriging\"?")));
  EXPECT_THAT(message_of([&] { read(unknown, ""); }), HasSubstr("reconstructor: no reconstructor"));
  for (const json* wrong : {&two, &number})
    EXPECT_THAT(message_of([&] { read(*wrong, "/r"); }), HasSubstr("expected one reconstructor"));
}

}  // namespace
}  // namespace halfgrad
