// What is known of a pair.
const uint kClipped = 1;      // moments and labels are final
const uint kEmpty = 2;
const uint kShortList = 3;    // the list ended before the cell was closed
const uint kCrowded = 4;      // more corners than there is room for
const uint kUnsure = 5;       // a decision within its error bound
const uint kWhole = 6;        // the cell holds all of the element
