#pragma once
/// The one way of findings and events into a record: what people read in them is the same everywhere.

#include <string>

#include "record/record.h"

namespace topple::record {

/// The text without the sign of numbers that are zero as they are written: "-0.00 m" becomes "0.00 m". Numbers stand
/// free: a minus behind a letter, digit or bracket belongs to a name or an exponent.
std::string drop_negative_zeros(const std::string& text);

/// A measure in millions of its unit, or in thousands or ones where at most one digit of it would show: "1.25 MJ",
/// "84.3 kJ", "12 J".
///   unit    "J", "N", "N s": that of the value
///   digits  behind the point of millions
std::string tell_measure(double value, const char* unit, int digits);

/// An azimuth between 0 and 360 deg: "359.75 deg".
///   digits  behind the point
std::string tell_azimuth(double azimuth, int digits = 0);

/// Digits behind the point of an angle as it was given in degrees, at most 6.
int count_digits_of_angle(double angle);

void add_finding(Record&, Finding);
void add_event(Record&, Event);

}  // namespace topple::record
