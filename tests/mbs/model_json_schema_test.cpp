// The schema, the reader and the page say the same; no damage to a file crashes the reader or passes unseen.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/file.h"
#include "mbs/model_json.h"
#include "mbs/solver.h"
#include "schema.h"

namespace topple::mbs {
namespace {

using Json = nlohmann::ordered_json;
using test::Schema;

const std::string root = std::string(TOPPLE_SOURCE_DIR) + "/";

const Schema& schema() {
  static const Schema s(Json::parse(read_file(root + "docs/mbs-model.schema.json")));
  return s;
}

std::string sample_text() { return read_file(root + "tests/data/everything.mbs.json"); }

/// What happens to a text; whatever else than these two is a crash of the test.
struct Outcome {
  bool accepted = false;
  std::vector<Diagnostic> complaints;
};

Outcome try_text(const std::string& text) {
  try {
    const Model m = model_from_json(text, "m.json");
    return {true, {}};
  } catch (const InputError& e) { return {false, e.diagnostics()}; }
}

/// Calls `visit` with each way from the root to a value.
void walk(const Json& value, Json::json_pointer at, const std::function<void(const Json::json_pointer&)>& visit) {
  if (!at.empty()) visit(at);
  if (value.is_object())
    for (const auto& [key, child] : value.items()) walk(child, at / key, visit);
  if (value.is_array())
    for (size_t i = 0; i < value.size(); ++i) walk(value[i], at / i, visit);
}

/// A changed file is refused with a place, or it is one that the schema allows.
void expect_sound(const Json& changed, const std::string& how) {
  const std::string text = changed.dump(1);
  const Outcome o = try_text(text);
  if (o.accepted) {
    EXPECT_EQ(schema().fault(changed), "") << how << ": accepted although the schema forbids it";
    const std::string again = to_json(model_from_json(text, "m.json"));
    EXPECT_EQ(to_json(model_from_json(again, "again.json")), again) << how;
    return;
  }
  ASSERT_FALSE(o.complaints.empty()) << how;
  for (const Diagnostic& d : o.complaints) {
    EXPECT_EQ(d.where.file, "m.json") << how;
    EXPECT_GE(d.where.line, 1) << how << ": " << d.message;
    EXPECT_FALSE(d.message.empty()) << how;
  }
}

TEST(ModelSchema, AllowsWhatTheReaderAllows) {
  EXPECT_EQ(schema().fault(Json::parse(sample_text())), "");
  const Outcome o = try_text(sample_text());
  EXPECT_TRUE(o.accepted) << (o.complaints.empty() ? "" : o.complaints.front().message);
  EXPECT_EQ(schema().fault(Json::parse(to_json(model_from_json(sample_text(), "m.json")))), "") << "what is written";
}

TEST(ModelSchema, HasTheKeysOfTheReader) {
  const auto keys_in = [](const Json& object) {
    std::set<std::string> keys;
    for (const auto& [key, value] : object.items()) keys.insert(key);
    return keys;
  };
  std::map<std::string, std::set<std::string>> of_schema, of_reader;
  of_schema["model"] = keys_in(schema().root()["properties"]);
  for (const auto& [name, definition] : schema().root()["$defs"].items()) {
    if (definition.contains("properties")) of_schema[name] = keys_in(definition["properties"]);
    if (definition.contains("anyOf"))
      for (const Json& one : definition["anyOf"])
        if (one.contains("properties")) of_schema[name] = keys_in(one["properties"]);
  }
  for (const KeyList& l : model_json_keys()) of_reader[l.object] = {l.keys.begin(), l.keys.end()};
  EXPECT_EQ(of_schema, of_reader);
}

TEST(ModelSchema, EveryKeyIsInTheSampleAndOnThePage) {
  const std::string page = read_file(root + "docs/mbs-model.md");
  std::set<std::string> used;
  const std::function<void(const Json&)> collect = [&](const Json& j) {
    for (const auto& [key, value] : j.items()) {
      if (j.is_object()) used.insert(key);
      if (value.is_structured()) collect(value);
    }
  };
  collect(Json::parse(sample_text()));
  for (const KeyList& l : model_json_keys())
    for (const std::string& key : l.keys) {
      EXPECT_TRUE(used.contains(key)) << l.object << "." << key << " is not in the sample";
      EXPECT_NE(page.find("`" + key + "`"), std::string::npos) << l.object << "." << key << " is not on the page";
    }
}

TEST(ModelSchema, EveryDefinitionIsUsedAndEveryNumberHasAUnitOrBounds) {
  const std::string text = schema().root().dump();
  for (const auto& [name, definition] : schema().root()["$defs"].items())
    EXPECT_NE(text.find("#/$defs/" + name + "\""), std::string::npos) << name;
  for (const auto& [name, definition] : schema().root()["$defs"].items()) {
    if (!definition.contains("properties")) continue;
    for (const auto& [key, rule] : definition["properties"].items())
      if (rule.contains("type") && rule["type"] == "number") {
        EXPECT_TRUE(rule.contains("description")) << name << "." << key;
      }
  }
}

TEST(ModelSchema, AllowsOfJointsWhatTheReaderAllows) {
  const std::vector<std::pair<std::string, Json>> keys = {{"at", {1, 0, 0}},
                                                          {"axis", {0, 1, 0}},
                                                          {"axes", {{1, 0, 0}, {0, 1, 0}}},
                                                          {"x", {1, 0, 0}},
                                                          {"points", {{0, 0, 0}, {1, 0, 0}}},
                                                          {"X_PF", Json::object()},
                                                          {"X_CM", Json::object()},
                                                          {"tension_limit", 1}};
  int allowed = 0;
  for (const std::string kind : {"fixed", "revolute", "spherical", "universal", "prismatic", "cylindrical", "distance"})
    for (unsigned some = 0; some < 1U << keys.size(); ++some) {
      Json joint = {{"kind", kind}, {"parent", "ground"}, {"child", "a"}};
      for (size_t k = 0; k < keys.size(); ++k)
        if (some >> k & 1) joint[keys[k].first] = keys[k].second;
      if (kind == "distance" && joint.contains("X_CM")) joint["X_CM"]["p"] = {1, 0, 0};
      Json file = Json::parse(R"({"format": "topple-mbs", "version": 2, "bodies": [
          {"name": "a", "mass": 1, "inertia": [1, 1, 1], "X_WB": {}}]})");
      file["joints"] = Json::array({joint});
      const std::string fault = schema().fault(file);
      const Outcome o = try_text(file.dump(1));
      EXPECT_EQ(fault.empty(), o.accepted)
          << joint << ": schema " << fault << "; reader " << (o.accepted ? "" : o.complaints.front().message);
      allowed += o.accepted;
    }
  EXPECT_GT(allowed, 20);
}

// -------------------------------------------------------------------------------------------------------------- damage

TEST(ModelJsonDamage, AValueTakenAway) {
  const Json sample = Json::parse(sample_text());
  walk(sample, Json::json_pointer(), [&](const Json::json_pointer& at) {
    Json j = sample;
    Json& parent = j[at.parent_pointer()];
    if (parent.is_object()) {
      parent.erase(at.back());
    } else {
      parent.erase(static_cast<size_t>(std::stoul(at.back())));
    }
    expect_sound(j, at.to_string() + " taken away");
  });
}

TEST(ModelJsonDamage, AValueOfAnotherKind) {
  const Json sample = Json::parse(sample_text());
  const std::vector<Json> others = {
      nullptr, true, 0.5, -3, "nobody", Json::array(), Json::object(), Json::array({1, 2, 3}), Json{{"p", 1}}, 1e300};
  walk(sample, Json::json_pointer(), [&](const Json::json_pointer& at) {
    for (const Json& other : others) {
      Json j = sample;
      if (j[at] == other) continue;
      j[at] = other;
      expect_sound(j, at.to_string() + " is " + other.dump());
    }
  });
}

TEST(ModelJsonDamage, AnItemGivenTwice) {
  const Json sample = Json::parse(sample_text());
  walk(sample, Json::json_pointer(), [&](const Json::json_pointer& at) {
    Json j = sample;
    Json& parent = j[at.parent_pointer()];
    if (!parent.is_array()) return;
    parent.push_back(Json(parent[static_cast<size_t>(std::stoul(at.back()))]));
    expect_sound(j, at.to_string() + " twice");
  });
}

TEST(ModelJsonDamage, AKeyGivenTwiceOrMisspelt) {
  const Json sample = Json::parse(sample_text());
  const std::string marker = "@@@";
  walk(sample, Json::json_pointer(), [&](const Json::json_pointer& at) {
    Json j = sample;
    Json& parent = j[at.parent_pointer()];
    if (!parent.is_object()) return;
    parent[marker] = Json(j[at]);
    std::string text = j.dump(1);
    const Outcome unknown = try_text(text);
    EXPECT_FALSE(unknown.accepted) << at.to_string();
    text.replace(text.find(marker), marker.size(), at.back());
    const Outcome twice = try_text(text);
    ASSERT_EQ(twice.complaints.size(), 1u) << at.to_string();
    EXPECT_NE(twice.complaints[0].message.find("given twice"), std::string::npos) << twice.complaints[0].message;
  });
}

TEST(ModelJsonDamage, ATextCutOff) {
  const std::string text = sample_text();
  const size_t end = text.find_last_of('}');
  for (size_t length = 0; length <= end; length += 5) {
    const Outcome o = try_text(text.substr(0, length));
    ASSERT_EQ(o.complaints.size(), 1u) << length;
    EXPECT_EQ(o.complaints[0].code, "E611") << length;
  }
}

TEST(ModelJsonDamage, BytesChangedAtRandom) {
  const std::string text = sample_text();
  std::mt19937 random(20);
  int accepted = 0;
  for (int i = 0; i < 4000; ++i) {
    std::string t = text;
    for (int k = 0; k <= i % 3; ++k) {
      const size_t at = random() % t.size();
      switch (random() % 3) {
        case 0:
          t[at] = static_cast<char>(random() % 256);
          break;
        case 1:
          t.erase(at, 1 + random() % 8);
          break;
        default:
          t.insert(at, t.substr(random() % t.size(), 1 + random() % 8));
      }
    }
    const Outcome o = try_text(t);
    accepted += o.accepted;
    if (!o.accepted) { EXPECT_FALSE(o.complaints.empty()); }
  }
  EXPECT_LT(accepted, 2000) << "damage passes unseen";
}

TEST(ModelJsonDamage, NestedTooDeep) {
  for (const auto& [open, text] : {std::pair{"list", std::string(1'000'000, '[')}, {"object", [] {
                                                                                      std::string t;
                                                                                      for (int i = 0; i < 100'000; ++i)
                                                                                        t += "{\"a\":";
                                                                                      return t;
                                                                                    }()}}) {
    const Outcome o = try_text(text);
    ASSERT_EQ(o.complaints.size(), 1u) << open;
    EXPECT_NE(o.complaints[0].message.find("deeper than"), std::string::npos) << open;
  }
}

// ------------------------------------------------------------------------------------------------------------ examples

/// The blocks of a page that are marked as JSON.
std::vector<std::string> blocks_of(const std::string& page) {
  std::vector<std::string> blocks;
  for (size_t at = page.find("```json\n"); at != std::string::npos; at = page.find("```json\n", at)) {
    at += 8;
    blocks.push_back(page.substr(at, page.find("```", at) - at));
  }
  return blocks;
}

TEST(ModelPage, EveryExampleIsRead) {
  // parts of a file are put into this one
  const std::string frame = R"({"format": "topple-mbs", "version": 2, "bodies": [
    {"name": "link1", "mass": 1, "inertia": [1, 1, 1], "X_WB": {"p": [1, 0, 0]}},
    {"name": "link2", "mass": 1, "inertia": [1, 1, 1], "X_WB": {"p": [3, 0, 0]}}],
    "joints": [{"name": "hinge", "kind": "revolute", "parent": "ground", "child": "link1", "at": [0, 0, 0], "axis": [0, 1, 0]}],
    "loads": [{"name": "push", "body": "link1", "force": [1, 0, 0]}]})";
  int whole = 0, parts = 0;
  for (const std::string& block : blocks_of(read_file(root + "docs/mbs-model.md"))) {
    Json j = Json::parse(block, nullptr, false);
    ASSERT_FALSE(j.is_discarded()) << block;
    ++(j.contains("format") ? whole : parts);
    if (!j.contains("format")) {
      Json together = Json::parse(frame);
      together.update(j);
      j = together;
    }
    EXPECT_EQ(schema().fault(j), "") << block;
    const Outcome o = try_text(j.dump(1));
    EXPECT_TRUE(o.accepted) << block << (o.complaints.empty() ? "" : o.complaints[0].message);
  }
  EXPECT_GE(whole, 2);
  EXPECT_GE(parts, 4);
}

TEST(ModelExamples, AreReadAndFollowTheSchema) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(root + "examples/mbs")) {
    if (entry.path().extension() != ".json") continue;
    ++files;
    const std::string text = read_file(entry.path());
    EXPECT_EQ(schema().fault(Json::parse(text)), "") << entry.path();
    const Outcome o = try_text(text);
    EXPECT_TRUE(o.accepted) << entry.path() << (o.complaints.empty() ? "" : o.complaints[0].message);
  }
  EXPECT_GE(files, 3);
}

}  // namespace
}  // namespace topple::mbs
