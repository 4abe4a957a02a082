#include "mbs/json_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace topple::mbs {

namespace {

constexpr size_t kDeepest = 32;     // levels of nesting
constexpr size_t kMostKeys = 1000;  // of one object

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/// Walks over the tokens of a text that is known to be JSON as far as it is walked.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;
  }
  size_t at() const { return at_; }
  /// To the next token that is no comma or colon.
  void seek() {
    while (at_ < text_.size() && (is_space(text_[at_]) || text_[at_] == ',' || text_[at_] == ':')) ++at_;
  }
  char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  /// Over the token at the cursor, which it returns.
  std::string_view take() {
    const size_t begin = at_;
    if (peek() == '"') {
      for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_)
        if (text_[at_] == '\\') ++at_;
      ++at_;
    } else if (std::string_view("{}[]").find(peek()) != std::string_view::npos) {
      ++at_;
    } else {
      while (at_ < text_.size() && !is_space(text_[at_]) && std::string_view(",:{}[]\"").find(text_[at_]) == npos)
        ++at_;
    }
    at_ = std::min(at_, text_.size());
    return text_.substr(begin, at_ - begin);
  }
  /// Over the whole value at the cursor.
  void skip() {
    int depth = 0;
    do {
      seek();
      const char c = peek();
      if (take().empty()) return;
      depth += c == '{' || c == '[' ? 1 : c == '}' || c == ']' ? -1 : 0;
    } while (depth > 0);
  }

 private:
  static constexpr size_t npos = std::string_view::npos;
  std::string_view text_;
  size_t at_ = 0;
};

SourcePosition position_of(const std::string& file, std::string_view text, size_t offset) {
  SourcePosition p{file, 1, 1};
  for (size_t i = text.starts_with("\xEF\xBB\xBF") ? 3 : 0; i < std::min(offset, text.size()); ++i) {
    if (text[i] == '\n') {
      ++p.line;
      p.column = 1;
    } else if ((static_cast<unsigned char>(text[i]) & 0xC0) != 0x80) {
      ++p.column;
    }
  }
  return p;
}

int width_of(std::string_view token) {
  return static_cast<int>(
      std::count_if(token.begin(), token.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

[[noreturn]] void refuse(const std::string& file, std::string_view text, size_t offset, std::string_view token,
                         std::string message, std::string help = {}) {
  Diagnostic d;
  d.code = "E611";
  d.where = position_of(file, text, offset);
  d.width = std::max(1, width_of(token));
  d.message = std::move(message);
  d.help = std::move(help);
  throw InputError(std::vector<Diagnostic>{d});
}

constexpr const char* kWhatItIs = "a multibody model is a JSON object with \"format\": \"topple-mbs\"";

/// Builds the tree out of the parser's reports and follows them in the text.
class Builder : public nlohmann::json_sax<Json> {
 public:
  Builder(const std::string& text, const std::string& file, Json& root)
      : text_(text), file_(file), scanner_(text), root_(root) {}

  bool null() override { return put(nullptr); }
  bool boolean(bool x) override { return put(x); }
  bool number_integer(number_integer_t x) override { return put(x); }
  bool number_unsigned(number_unsigned_t x) override { return put(x); }
  bool number_float(number_float_t x, const string_t&) override { return put(x); }
  bool string(string_t& x) override { return put(std::move(x)); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    scanner_.seek();
    const size_t offset = scanner_.at();
    const std::string_view token = scanner_.take();
    Json& object = *stack_.back();
    if (object.size() >= kMostKeys)
      refuse(file_, text_, offset, token, fmt::format("an object with more than {} keys", kMostKeys));
    if (object.contains(name))
      refuse(file_, text_, offset, token, "the key \"" + name + "\" is given twice",
             "each key stands once in an object");
    slot_ = &object[name];
    return true;
  }
  bool parse_error(std::size_t position, const std::string& token, const nlohmann::detail::exception& e) override {
    if (e.id == 406) {
      scanner_.seek();
      const size_t offset = scanner_.at();
      refuse(file_, text_, offset, scanner_.take(), "the number " + token + " is too large");
    }
    // "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error while ... - what; last read: ..."
    std::string what = e.what();
    const size_t colon = what.find("syntax error");
    what = colon == std::string::npos ? "" : what.substr(colon);
    if (const size_t dash = what.find(" - "); dash != std::string::npos) what = what.substr(dash + 3);
    refuse(file_, text_, position > 0 ? position - 1 : 0, {}, "this is not JSON" + (what.empty() ? "" : ": " + what),
           kWhatItIs);
  }

 private:
  /// Where the next value goes.
  Json& place() {
    if (stack_.empty()) return root_;
    if (stack_.back()->is_object()) return *slot_;
    stack_.back()->push_back(nullptr);
    return stack_.back()->back();
  }
  template <class T>
  bool put(T value) {
    scanner_.seek();
    scanner_.take();
    place() = std::move(value);
    return true;
  }
  bool open(Json value) {
    scanner_.seek();
    const size_t offset = scanner_.at();
    scanner_.take();
    if (stack_.size() >= kDeepest)
      refuse(file_, text_, offset, {}, fmt::format("nested deeper than {} levels", kDeepest));
    Json& at = place();
    at = std::move(value);
    stack_.push_back(&at);
    return true;
  }
  bool close() {
    scanner_.seek();
    scanner_.take();
    stack_.pop_back();
    return true;
  }

  const std::string& text_;
  const std::string& file_;
  Scanner scanner_;
  Json& root_;
  std::vector<Json*> stack_;  // open objects and lists; they do not move while they are open
  Json* slot_ = nullptr;      // of the key just read
};

/// One part of a path: a key, or an index when the key is empty.
struct Step {
  std::string key;
  size_t index = 0;
};

std::vector<Step> steps_of(std::string_view path) {
  std::vector<Step> steps;
  size_t i = 0;
  while (i < path.size()) {
    if (path[i] == '[') {
      const size_t close = std::min(path.find(']', i), path.size());
      size_t index = 0;
      for (size_t k = i + 1; k < close; ++k) index = 10 * index + static_cast<size_t>(path[k] - '0');
      steps.push_back({{}, index});
      i = close + 1;
    } else {
      if (path[i] == '.') ++i;
      const size_t end = std::min(path.find_first_of(".[", i), path.size());
      steps.push_back({std::string(path.substr(i, end - i)), 0});
      i = end;
    }
  }
  return steps;
}

/// Puts the scanner on the value, or on the key of the value, that the steps lead to; stops where they leave the text.
void descend(Scanner& s, const std::vector<Step>& steps) {
  s.seek();
  for (size_t k = 0; k < steps.size(); ++k) {
    const Step& step = steps[k];
    const Scanner here = s;
    if (s.peek() != (step.key.empty() ? '[' : '{')) return;
    s.take();
    s.seek();
    bool found = false;
    for (size_t i = 0; s.peek() != ']' && s.peek() != '}' && s.peek() != '\0'; ++i, s.seek()) {
      const Scanner at_key = s;
      if (!step.key.empty()) {
        const Json key = Json::parse(s.take(), nullptr, false);
        s.seek();
        found = key.is_string() && key.get_ref<const std::string&>() == step.key;
      } else {
        found = i == step.index;
      }
      if (found && k + 1 == steps.size()) s = at_key;
      if (found) break;
      s.skip();
    }
    if (!found) {
      s = here;
      return;
    }
  }
}

/// Appends the path from `from` to `to`; false if it is not below.
bool find_path(const Json& from, const Json* to, std::string& path) {
  if (&from == to) return true;
  const size_t length = path.size();
  if (from.is_object()) {
    for (const auto& [key, value] : from.items()) {
      path += (path.empty() ? "" : ".") + key;
      if (find_path(value, to, path)) return true;
      path.resize(length);
    }
  } else if (from.is_array()) {
    for (size_t i = 0; i < from.size(); ++i) {
      path += fmt::format("[{}]", i);
      if (find_path(from[i], to, path)) return true;
      path.resize(length);
    }
  }
  return false;
}

}  // namespace

JsonDocument::JsonDocument(std::string text, std::string name) : text_(std::move(text)), name_(std::move(name)) {
  if (text_.find_first_not_of(" \t\r\n") == std::string::npos)
    refuse(name_, text_, 0, {}, "the file is empty", kWhatItIs);
  // which would end the text for the parser
  if (const size_t at = text_.find('\0'); at != std::string::npos)
    refuse(name_, text_, at, {}, "a zero byte is no JSON", "the file may be damaged");
  Builder builder(text_, name_, root_);
  Json::sax_parse(text_, &builder);
}

Diagnostic JsonDocument::make_diagnostic(std::string code, std::string_view path, std::string message,
                                         std::string help) const {
  Scanner scanner(text_);
  descend(scanner, steps_of(path));
  Diagnostic d;
  d.code = std::move(code);
  d.where = position_of(name_, text_, scanner.at());
  const std::string_view token = scanner.take();
  d.width = std::max(1, width_of(token));
  d.message = std::move(message);
  d.help = std::move(help);
  return d;
}

std::string JsonDocument::path_of(const Json& value) const {
  std::string path;
  find_path(root_, &value, path);
  return path;
}

std::string JsonNode::path() const { return document_->path_of(*json_); }

void JsonNode::fail(const std::string& what, const std::string& help) const {
  const std::string where = path();
  throw InputError(std::vector<Diagnostic>{
      document_->make_diagnostic("E610", where, (where.empty() ? "the file" : where) + ": " + what, help)});
}

void JsonNode::fail_at(const std::string& key, const std::string& what, const std::string& help) const {
  const std::string above = path();
  const std::string where = above.empty() ? key : above + "." + key;
  throw InputError(std::vector<Diagnostic>{
      document_->make_diagnostic("E610", where, (above.empty() ? "the file" : above) + ": " + what, help)});
}

JsonNode JsonNode::operator[](const char* key) const {
  if (!json_->is_object()) fail("must be an object");
  const auto it = json_->find(key);
  if (it == json_->end()) fail(std::string("needs \"") + key + "\"");
  return {*it, *document_};
}

std::vector<JsonNode> JsonNode::items() const {
  if (!json_->is_array()) fail("must be a list");
  std::vector<JsonNode> out;
  out.reserve(json_->size());
  for (const Json& item : *json_) out.emplace_back(item, *document_);
  return out;
}

double JsonNode::number() const {
  if (!json_->is_number()) fail("must be a number");
  const double x = json_->get<double>();
  if (!std::isfinite(x)) fail("is not finite");
  return x;
}

double JsonNode::positive() const {
  const double x = number();
  if (!(x > 0)) fail(fmt::format("must be > 0, is {:g}", x));
  return x;
}

int JsonNode::integer(int low) const {
  constexpr int high = 100'000'000;
  if (json_->is_number_float()) {  // 2.0
    const double x = json_->get<double>();
    if (x != std::floor(x)) fail("must be a whole number");
    if (!(x >= low && x <= high)) fail(fmt::format("is out of range: {:g}", x));
    return static_cast<int>(x);
  }
  if (!json_->is_number_integer()) fail("must be a whole number");
  if (json_->is_number_unsigned() && json_->get<std::uint64_t>() > high) fail("is out of range");
  const auto x = json_->get<std::int64_t>();
  if (x < low || x > high) fail("is out of range: " + std::to_string(x));
  return static_cast<int>(x);
}

bool JsonNode::flag() const {
  if (!json_->is_boolean()) fail("must be true or false");
  return json_->get<bool>();
}

std::string JsonNode::text() const {
  if (!json_->is_string()) fail("must be a string");
  std::string x = json_->get<std::string>();
  for (const char c : x)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) fail("holds a control character");
  return x;
}

std::vector<double> JsonNode::numbers() const {
  std::vector<double> out;
  for (const JsonNode& n : items()) out.push_back(n.number());
  return out;
}

Vec3 JsonNode::vec3() const {
  if (!is_list() || json_->size() != 3) fail("needs a list of three numbers");
  const auto n = numbers();
  return {n[0], n[1], n[2]};
}

Vec3 JsonNode::direction() const {
  const Vec3 v = vec3();
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0)) fail("is no direction: all three numbers are 0");
  const Vec3 scaled{v.x / largest, v.y / largest, v.z / largest};  // 1/largest may be infinite
  return (1 / norm(scaled)) * scaled;
}

Mat3 JsonNode::mat3() const {
  const auto rows = items();
  if (rows.size() != 3) fail("needs three rows of three numbers");
  Mat3 m;
  for (int i = 0; i < 3; ++i) {
    const Vec3 r = rows[static_cast<size_t>(i)].vec3();
    for (int j = 0; j < 3; ++j) m(i, j) = r[j];
  }
  return m;
}

Pose JsonNode::pose() const {
  only({"p", "q", "axis", "angle"});
  Pose X;
  if (has("p")) X.p = (*this)["p"].vec3();
  if (has("axis") != has("angle")) fail("\"axis\" and \"angle\" belong together");
  if (has("q") && has("axis")) fail("give \"q\" or \"axis\" and \"angle\", not both");
  if (has("axis")) X.q = exp_rotation((*this)["angle"].number() * (*this)["axis"].direction());
  if (!has("q")) return X;
  const JsonNode n = (*this)["q"];
  if (!n.is_list() || n.json_->size() != 4) n.fail("needs a list of four numbers, w x y z");
  const auto q = n.numbers();
  X.q = {q[0], q[1], q[2], q[3]};
  const double error = std::abs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1);
  if (!(error < 1e-9))
    n.fail("is not a unit quaternion", "\"axis\": [x, y, z] and \"angle\" in radians describe a turn, too");
  // what a program wrote stays as it is; what was typed with fewer digits is rounded to a turn
  if (error > 1e-14) X.q = normalized(X.q);
  return X;
}

int JsonNode::word(const std::vector<std::string>& words) const {
  const std::string given = text();
  const auto it = std::find(words.begin(), words.end(), given);
  if (it != words.end()) return static_cast<int>(it - words.begin());
  const std::string near = nearest_name(given, words);
  std::string all;
  for (const std::string& w : words) all += (all.empty() ? "" : ", ") + w;
  fail("does not know \"" + given + "\"" + (near.empty() ? "" : "; did you mean \"" + near + "\"?"), "one of: " + all);
}

void JsonNode::only(const std::vector<std::string>& known) const {
  if (!json_->is_object()) fail("must be an object");
  for (const auto& [key, value] : json_->items())
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      const std::string near = nearest_name(key, known);
      fail_at(key, "unknown key \"" + key + "\"" + (near.empty() ? "" : "; did you mean \"" + near + "\"?"));
    }
}

}  // namespace topple::mbs
