// Pieces of common track systems, from the makers' public catalogues.

const straight = (name, mm) => ({ name, kind: "straight", mm });
const curve = (name, radius, angle) => ({ name, kind: "curve", radius, angle });
const turnout = (name, mm, radius, angle) => ({ name, kind: "turnout", mm, radius, angle });
const crossing = (name, mm, angle) => ({ name, kind: "crossing", mm, angle });
const slip = (name, mm, radius, angle) => ({ name, kind: "slip", mm, radius, angle });

/** Lengths and radii in mm, angles in degrees. Curves, turnouts, crossings and slips exist for both hands. */
export const LIBRARIES = {
  "Märklin C (H0)": [
    straight("24188", 188.3), straight("24172", 171.7), straight("24229", 229.3), straight("24094", 94.2), straight("24077", 77.5),
    curve("24130 R1", 360, 30), curve("24115 R1", 360, 15), curve("24230 R2", 437.5, 30), curve("24224 R2", 437.5, 24.3), curve("24330 R3", 515, 30),
    turnout("24611/24612", 188.3, 437.5, 24.3), crossing("24640", 188.3, 24.3), crossing("24649", 103.3, 48.6), crossing("24740", 236.1, 12.1), slip("24624", 188.3, 437.5, 24.3),
  ],
  "Märklin K (H0)": [
    straight("2200", 180), straight("2206", 168.9), straight("2207", 156), straight("2201", 90), straight("2202", 45),
    curve("2221 R1", 360, 30), curve("2223 R1", 360, 15), curve("2231 R2", 424.6, 30), curve("2234 R2", 424.6, 22.5),
    turnout("22715/22716", 168.9, 424.6, 22.5), crossing("2259", 168.9, 22.5), slip("2260", 168.9, 424.6, 22.5),
  ],
  "Roco geoLine (H0)": [
    straight("61110 G200", 200), straight("61111 G185", 185), straight("61113 G76.5", 76.5),
    curve("61122 R2", 358, 30), curve("61123 R3", 434.5, 30), curve("61124 R4", 511.1, 30), curve("61128", 502.7, 22.5),
    turnout("61140/61141", 200, 502.7, 22.5),
  ],
  "Peco Setrack (00/H0)": [
    straight("ST-200", 168), straight("ST-201", 335), straight("ST-202", 79), straight("ST-203", 41),
    curve("ST-221 R1", 371, 45), curve("ST-226 R2", 438, 45), curve("ST-225 R2", 438, 22.5), curve("ST-231 R3", 505, 45),
    turnout("ST-240/ST-241", 168, 438, 22.5), crossing("ST-250/ST-251", 168, 22.5), slip("SL-90 Streamline", 249, 610, 12),
  ],
  "Kato Unitrack (N)": [
    straight("20-000", 248), straight("20-010", 186), straight("20-020", 124), straight("20-040", 62),
    curve("20-100", 249, 45), curve("20-110", 282, 45), curve("20-120", 315, 45), curve("20-150", 718, 15),
    turnout("20-202/20-203", 186, 718, 15), crossing("20-320/20-321", 186, 15), crossing("20-340", 124, 90),
  ],
};

/** The length of a curve, or of a turnout's curved leg. */
export const arcOf = ({ radius, angle }) => radius * angle * Math.PI / 180;

/** Half the way through a slip: its straight ways and its curved ones, which are 1 % shorter, have one length in a layout. */
export function halfOfSlip({ mm, radius, angle }) {
  const curved = mm - 2 * radius * Math.tan(angle * Math.PI / 360) + arcOf({ radius, angle });
  return (mm + curved) / 4;
}
