#pragma once
/// The self-contained page of a report of resistance curves.

#include <string>
#include <vector>

#include "record/rcc_figures.h"

namespace topple::record {

/// One HTML document that needs nothing else: no script, no network.
std::string to_page(const RccReport&, const std::vector<Figure>&);

/// Parts that pages have in common.
std::string page_head(const std::string& title);
std::string table_html(const FigureTable&);
/// Figures under their headings, each with its table; `level` of the headings.
std::string figures_html(const std::vector<Figure>&);
std::string list_html(const std::string& heading, const std::vector<std::string>& items);
std::string inputs_html(const std::vector<KeyValue>&);
std::string provenance_html(const std::string& source, const std::string& sha256, const std::string& version);

}  // namespace topple::record
