#pragma once
/// Two records of one building beside each other, e.g. of the multibody model and of finite elements (docs/compare.md).

#include <string>
#include <utility>
#include <vector>

#include "record/record.h"

namespace topple::record {

/// A series that both records have, at the same instants. T instants.
struct SeriesPair {
  std::string id, title, unit, group;
  std::vector<double> a, b;  // (T)
};

/// When a body first touches the ground; NaN: not up to the end of the record.
struct TouchdownPair {
  std::string body;
  double a = 0, b = 0;  // [s]
};

struct Comparison {
  // what moved the building: "native", "finite elements"; where both are alike with what tells their files apart
  std::string name_a, name_b;
  std::string title_a, title_b;
  std::string note;          // a sentence: that they are told apart by their titles; empty: they are not
  std::vector<double> time;  // frames of A within the time that both have [s]       (T)
  // with three bodies in common also "lean_compared", the angle from the vertical of all of them by least squares; none
  // of tilts where the records count them towards different azimuths
  std::vector<SeriesPair> series;
  std::string points;                     // a sentence: what was compared by position
  int matched = 0;                        // bodies of the same name in both
  std::vector<double> rms;                // distance of the matched bodies, root of the mean square by mass [m] (T)
  std::vector<double> largest;            // of the matched bodies [m] (T)
  std::vector<int> farthest;              // which, index into A's bodies; -1: none (T)
  std::vector<double> centre;             // distance of the mass centres of everything that moves [m] (T)
  std::vector<TouchdownPair> touchdowns;  // bodies that touch the ground in either, in the order of time
  // up to the earlier first touchdown of the upper block, or the end of the common time
  double touchdown_a = 0, touchdown_b = 0;                  // of the upper block; NaN: none, or not known [s]
  bool knows_touchdown_a = true, knows_touchdown_b = true;  // records of models know no upper block
  double end_a = 0, end_b = 0;                              // of the records [s]
  double until = 0;                                         // [s]
  bool are_tilts_alike = true;                              // counted towards one azimuth, as far as is known
  double fall_azimuth_a = 0, fall_azimuth_b = 0;            // towards which they count; NaN: not known [rad]
  double tilt_difference = 0;                               // largest |a - b| [rad]; NaN: not known of both
  double tilt_time = 0;                                     // when [s]; NaN likewise
  double tilt_share = 0;         // over the larger of both tilts at `until`; NaN: nothing tilts
  double centre_difference = 0;  // largest distance of mass centres [m]
  // angle between both axes of "lean_compared" [rad] (T), and the azimuths of both at the end [rad]; NaN: none
  std::vector<double> lean_apart;
  double lean_azimuth_a = 0, lean_azimuth_b = 0;
};

/// Of two paths the last parts that differ, without extension: "left", "right" of left/record.h5 and right/record.h5.
/// Both empty where they are one file.
std::pair<std::string, std::string> tell_files_apart(const std::string& a, const std::string& b);

/// Throws InputError E680: records without a frame in common time.
///   path_a, path_b  where they come from, for names; may be empty
Comparison compare(const Record& a, const Record& b, const std::string& path_a = {}, const std::string& path_b = {});

/// How they differ, in a sentence each: touchdown, tilt, mass centres, lean at the end.
std::vector<std::string> summarise(const Comparison&);
/// Lines for people: the summary, touchdowns, tilt at instants, energies.
std::string describe(const Comparison&, const Record& a, const Record& b);
/// One line an instant: time, each series of A, of B and the difference, distances.
std::string to_csv(const Comparison&, const Record& a);
std::string to_json(const Comparison&, const Record& a);

/// A picture of the real event.
struct Photo {
  double time = 0;  // of the plan [s]
  std::string name;
  std::string data;  // as a data: address
};
/// Table "time,file" with seconds and paths beside the table (JPEG, PNG or WebP); lines that begin with # and a heading
/// are passed over. Throws InputError E681 with the line.
std::vector<Photo> read_photos(const std::string& path);

/// One self-contained page of both records; `bundle` is the built page with the marker.
void write_compare_page(const Comparison&, const Record& a, const Record& b, const std::vector<Photo>&,
                        const std::string& bundle, const std::string& path);

}  // namespace topple::record
