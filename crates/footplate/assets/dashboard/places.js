// The nodes of a layout belong to places: each place has two nodes, one for each direction of travel.

/** The place of a node. */
export const placeOf = (node) => node >> 1;
/** +1 if a node is passed in the direction of its place's first name, −1 otherwise. */
export const senseOf = (node) => (node % 2 ? -1 : 1);
