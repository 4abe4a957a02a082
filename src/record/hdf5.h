#pragma once
/// The record's file in memory; record.h writes and reads it on disk.

#include <string>

#include "record/record.h"

namespace topple::record {

/// The bytes that write_hdf5 writes. Throws std::runtime_error if the library refuses.
std::string to_hdf5(const Record&);

}  // namespace topple::record
