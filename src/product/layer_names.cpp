#include "product/layer_names.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <set>
#include <vector>

#include "base/utf8.h"

namespace topple::product {

namespace {

bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_lower(char c) { return c >= 'a' && c <= 'z'; }

/// Umlauts by two letters; other characters beyond ASCII end a word.
std::string spell_out(const std::string& text) {
  std::string out;
  for (size_t i = 0; i < text.size();) {
    const size_t length = std::max<size_t>(1, utf8_length(std::string_view(text).substr(i)));
    const std::string c = text.substr(i, length);
    static const std::vector<std::pair<std::string, std::string>> letters{
        {"ä", "ae"}, {"ö", "oe"}, {"ü", "ue"}, {"ß", "ss"}, {"Ä", "AE"}, {"Ö", "OE"}, {"Ü", "UE"}};
    const auto found = std::find_if(letters.begin(), letters.end(), [&c](const auto& l) { return l.first == c; });
    out += found != letters.end() ? found->second : length == 1 ? c : std::string(" ");
    i += length;
  }
  return out;
}

/// In lower case, split at all that is no letter and where a capital begins: "DN100_GasLeitung": dn, gas, leitung.
std::vector<std::string> split_words(const std::string& text) {
  const std::string s = spell_out(text);
  std::vector<std::string> out(1);
  for (size_t i = 0; i < s.size(); ++i) {
    const char c = s[i];
    const bool begins =
        is_upper(c) && i > 0 && (is_lower(s[i - 1]) || (is_upper(s[i - 1]) && i + 1 < s.size() && is_lower(s[i + 1])));
    if (begins || !(is_upper(c) || is_lower(c))) out.emplace_back();
    if (is_upper(c) || is_lower(c)) out.back() += static_cast<char>(is_upper(c) ? c - 'A' + 'a' : c);
  }
  std::erase(out, std::string());
  return out;
}

/// Whether a word is one of the first and one of the last.
bool is_compound(const std::string& word, const std::set<std::string>& first, const std::set<std::string>& last) {
  for (size_t i = 2; i + 2 < word.size(); ++i)
    if (first.count(word.substr(0, i)) > 0 && last.count(word.substr(i)) > 0) return true;
  return false;
}

}  // namespace

std::string decode_dxf_text(const std::string& text) {
  std::string out;
  for (size_t i = 0; i < text.size();) {
    const bool is_code =
        text.compare(i, 3, "\\U+") == 0 && i + 7 <= text.size() &&
        std::all_of(text.begin() + static_cast<std::ptrdiff_t>(i + 3),
                    text.begin() + static_cast<std::ptrdiff_t>(i + 7),
                    [](char c) { return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'F') || (c >= 'a' && c <= 'f'); });
    if (!is_code) {
      out += text[i++];
      continue;
    }
    append_utf8(out, static_cast<std::uint32_t>(std::strtoul(text.substr(i + 3, 4).c_str(), nullptr, 16)));
    i += 7;
  }
  return out;
}

bool names_utility(const std::string& layer) {
  // pipes and cables whatever stands beside them
  static const std::set<std::string> sure{
      "abwasser",      "cable",         "cables",       "duct",        "ducts",      "elektrokabel", "entwaesserung",
      "fernheizung",   "fernwaerme",    "frischwasser", "gasline",     "gaslines",   "gasmain",      "gasmains",
      "gaspipe",       "gaspipes",      "glasfaser",    "kabel",       "kanal",      "kanaele",      "kanalisation",
      "leitung",       "leitungen",     "mischwasser",  "nahwaerme",   "pipe",       "pipeline",     "pipelines",
      "pipes",         "powercable",    "powercables",  "powerline",   "powerlines", "regenwasser",  "rohrleitung",
      "rohrleitungen", "schmutzwasser", "sewage",       "sewer",       "sewerage",   "sewers",       "stormwater",
      "telecom",       "telecoms",      "telekom",      "trinkwasser", "utilities",  "utility",      "wastewater",
      "watermain",     "watermains",    "waterpipe",    "waterpipes"};
  // what may also stand in the name of a building
  static const std::set<std::string> likely{"drain",    "drainage",      "electric",  "electrical", "electricity",
                                            "elektrik", "elektrizitaet", "elektro",   "gas",        "power",
                                            "strom",    "telefon",       "telephone", "wasser",     "water"};
  static const std::set<std::string> buildings{
      "bau",     "bauten", "becken", "building", "buildings", "gebaeude", "halle",   "haus",
      "haeuser", "hof",    "house",  "houses",   "lake",      "mill",     "muehle",  "park",
      "plant",   "pool",   "pumpe",  "see",      "shed",      "station",  "strasse", "street",
      "tank",    "tanks",  "tower",  "towers",   "turm",      "tuerme",   "werk",    "works"};
  static const std::set<std::string> first{
      "abwasser",      "dampf",           "daten",     "druck",           "elektro", "entwaesserungs", "erd",
      "erdgas",        "fernheiz",        "fernmelde", "fernwaerme",      "frei",    "frischwasser",   "gas",
      "glasfaser",     "haupt",           "heiz",      "hochspannungs",   "kanal",   "kuehlwasser",    "loeschwasser",
      "mischwasser",   "mittelspannungs", "nahwaerme", "niederspannungs", "oel",     "regenwasser",    "rohr",
      "schmutzwasser", "steuer",          "strom",     "telefon",         "telekom", "trinkwasser",    "versorgungs",
      "waerme",        "wasser"};
  static const std::set<std::string> last{"anschluss", "hausanschluss", "kabel",     "kanal", "kanaele",
                                          "leitung",   "leitungen",     "netz",      "rohr",  "rohre",
                                          "trasse",    "trassen",       "versorgung"};
  const std::vector<std::string> words = split_words(layer);
  const auto any = [&words](const auto& is) { return std::any_of(words.begin(), words.end(), is); };
  if (any([](const std::string& w) { return sure.count(w) > 0 || is_compound(w, first, last); })) return true;
  return any([](const std::string& w) { return likely.count(w) > 0; }) &&
         !any([](const std::string& w) { return buildings.count(w) > 0; });
}

}  // namespace topple::product
