#pragma once
/// The state of a running system as bytes, for going on later on the same model and machine.

#include <cstddef>
#include <vector>

namespace topple::mbs {

class System;

std::vector<std::byte> write_snapshot(System&);
/// Throws InputError if the bytes are not a snapshot of this model.
void read_snapshot(const std::vector<std::byte>&, System&);

}  // namespace topple::mbs
