#pragma once
/// A record in the formats of other programs (docs/exports.md). SI, z up, unless a format asks for something else.

#include <functional>
#include <string>
#include <vector>

#include "record/record.h"

namespace topple::record {

/// The record with the first frame, the last one and of the others those that lie at least `interval` [s] after the
/// one kept before. Everything that is not per frame stays as it is.
Record keep_frames(const Record&, double interval);

/// Writes series.csv, events.csv, bodies.csv, findings.csv (write_csv), outputs/NAME.csv, and per frame poses.csv (one
/// line per frame and body) and zones.csv (one line per frame and zone whose state has changed). Returns the paths.
std::vector<std::string> export_csv(const Record&, const std::string& folder);

/// Writes record.pvd, which ParaView opens, and vtk/*.vtu: for each frame the parts as hexahedra and the zones as
/// vertices, once the outlines of the building and of the neighbours. Files of an earlier export are taken away first.
/// Returns the paths, record.pvd first; none where `is_cancelled` says so between two frames, and leaves nothing then.
std::vector<std::string> export_vtk(const Record&, const std::string& folder,
                                    const std::function<bool()>& is_cancelled = {});

/// The record as one binary glTF 2.0 file (y up, as that format has it) with its motion as an animation.
std::string to_gltf(const Record&);
/// Writes it to record.glb.
std::vector<std::string> export_gltf(const Record&, const std::string& folder);

/// Writes record.json: what the report page reads, with poses and zones as plain lists of numbers.
std::vector<std::string> export_json(const Record&, const std::string& folder);

}  // namespace topple::record
