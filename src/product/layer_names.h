#pragma once
/// What the layers of a drawing are called.

#include <string>

namespace topple::product {

/// \U+00DC as its character, as DXF writes what its code page lacks.
std::string decode_dxf_text(const std::string&);

/// Whether a layer is named like pipes or cables: gas, water, sewer, power and their German names, as words of their
/// own or in compounds such as Gasleitung. Gasse, Wasserturm and Powerhouse are none.
bool names_utility(const std::string& layer);

}  // namespace topple::product
