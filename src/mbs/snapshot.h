#pragma once
/// The state of a running system as bytes, for going on later on the same model and machine.

#include <cstddef>
#include <vector>

namespace topple::mbs {

class System;

std::vector<std::byte> write_snapshot(System&);
/// The same without the fingerprint of the model, for going on in this process.
std::vector<std::byte> write_state(System&);
/// The system must have as many items of each kind as the one that was written. Throws InputError E620.
void read_state(const std::vector<std::byte>&, System&);
/// Throws InputError if the bytes are not a snapshot of this model.
void read_snapshot(const std::vector<std::byte>&, System&);

}  // namespace topple::mbs
