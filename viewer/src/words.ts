// A report in plain words.
import { counted, short, whole } from "./dom";

// Reports differ by command, and every key may be absent.
export type Json = any;

const percent = (share: number) => `${short(100 * share)} %`;

function size(mesh: Json): string {
  if (mesh.points !== undefined) return counted(mesh.points, "point");
  const parts = [counted(mesh.vertices, "vertex", "vertices")];
  if (mesh.tets) parts.push(counted(mesh.tets, "tetrahedron", "tetrahedra"));
  if (mesh.faces !== undefined) parts.push(counted(mesh.faces, mesh.tets ? "boundary triangle" : "face"));
  return parts.join(", ");
}

function topology(t: Json): string {
  const parts = [t.manifold ? "a manifold" : "not a manifold", t.closed ? "closed" : "open",
    t.oriented ? "with one side out everywhere" : "not oriented alike everywhere",
    `in ${counted(t.components, "part")}`];
  let text = `The surface is ${parts.join(", ")}; its Euler characteristic is ${t.euler}.`;
  if (t.matches_input === true) text += " That is as in the input.";
  if (t.matches_input === false) text += " The input's topology is another.";
  const wrong = [[t.boundary_edges, "border edge"], [t.non_manifold_edges, "edge of more than two triangles",
    "edges of more than two triangles"], [t.non_manifold_vertices, "vertex where sheets touch",
    "vertices where sheets touch"]].filter(([n]) => n > 0).map(([n, one, many]) => counted(n, one, many));
  if (wrong.length > 0) text += ` It has ${wrong.join(", ")}.`;
  if (t.conforming === true) text += " All tetrahedra meet facet to facet.";
  if (t.conforming === false) text += " The tetrahedra do not all meet facet to facet.";
  return text;
}

function quality(q: Json): string {
  const parts: string[] = [];
  if (q.dihedral_min !== undefined)
    parts.push(`Dihedral angles are between ${short(q.dihedral_min)} and ${short(q.dihedral_max)} degrees; the ` +
      `radius ratio is ${short(q.radius_ratio_mean)} on average and ${short(q.radius_ratio_min)} at least (1 is ` +
      "regular).");
  if (q.theta_min !== undefined)
    parts.push(`The smallest angle of a triangle is ${short(q.theta_min)} degrees` + (q.theta_below_30 > 0
      ? `, and ${short(q.theta_below_30)} % of triangles have one below 30.` : "; no triangle has one below 30."),
    `Q is ${short(q.q_ave)} on average and ${short(q.q_min)} at least (1 is equilateral); ${percent(q.valence6)} of ` +
      "the interior vertices have six neighbours.");
  if (q.self_intersections === 0) parts.push("The surface does not intersect itself.");
  if (q.self_intersections > 0)
    parts.push(`${counted(q.self_intersections, "pair")} of triangles ${q.self_intersections === 1 ? "intersects" :
      "intersect"}.`);
  if (q.inverted > 0) parts.push(`${counted(q.inverted, "tetrahedron is", "tetrahedra are")} inside out.`);
  return parts.join(" ");
}

function device(d: Json): string {
  const where = d.kind === "cpu" ? `on the CPU (${d.name})` : `on ${d.name}, ${d.kind === "software"
    ? "a device in software" : `a GPU of the kind ${d.kind}`}`;
  return `Computed ${where} in ${d.precision} precision.` + (d.fallback ? ` The CPU took over: ${d.fallback}.` : "");
}

function certification(c: Json, command: string): string {
  const piece = command === "tet" ? "tetrahedron or boundary triangle" : "triangle";
  const text = `In the last diagram ${whole(c.pairs)} pairs of a ${piece} and a cell meet, and each is certain. `;
  if (c.uncertain === 0) return `${text}Error bounds decided all of them.`;
  const ways = [[c.wider, "with more neighbours"], [c.double, "in double precision"], [c.cpu, "in exact arithmetic"]]
    .filter(([n]) => n > 0).map(([n, how]) => `${whole(n)} ${how}`);
  return `${text}Error bounds decided all but ${whole(c.uncertain)} at first` +
    (ways.length > 0 ? `; ${ways.join(", ")}.` : ", which a closer look did.");
}

function features(f: Json): string {
  if (f.curves === 0) return "There are no feature curves.";
  const kept = f.broken === 0 ? `All ${whole(f.curves)} feature curves are` : `${whole(f.curves - f.broken)} of ${
    counted(f.curves, "feature curve")} are`;
  return `${kept} chains of edges of the result, between ${counted(f.corners, "corner")}.`;
}

function regions(s: Json): string {
  const kinds = new Map<string, number>();
  for (const region of s.regions) kinds.set(region.type, (kinds.get(region.type) ?? 0) + 1);
  const list = [...kinds].sort((a, b) => b[1] - a[1]).map(([kind, n]) => `${kind.replaceAll("_", " ")} (${n})`);
  return `${counted(s.regions.length, "region")}: ${list.join(", ")}. They are ${short(s.rms_percent)} % of the ` +
    "diagonal from their surfaces (root mean square).";
}

function tree(report: Json): string {
  const t = report.tree, c = report.coverage;
  return `${counted(t.trunks, "trunk")} and ${counted(t.branches - t.trunks, "branch", "branches")} of orders up to ${
    t.order}: ${short(t.length)} long in all, with a volume of ${short(t.volume)}. ${percent(c.within_2_radii)} of ` +
    "the points lie within two radii of a branch.";
}

function distance(q: Json): string {
  return `${short(q.distance_rms)} % of the diagonal (root mean square), at most ${short(q.distance_max)} %.`;
}

// Headings and sentences.
export function inWords(report: Json): [string, string][] {
  const said: [string, string][] = [];
  const say = (heading: string, text: string | undefined | false) => { if (text) said.push([heading, text]); };
  say("Input", report.input && size(report.input));
  say("Reference", report.reference && size(report.reference));
  say("Result", report.output && size(report.output));
  say("Elements", report.quality && quality(report.quality));
  say("Distance", report.quality?.distance_rms !== undefined && distance(report.quality));
  say("Topology", report.topology && topology(report.topology));
  say("Features", report.features && features(report.features));
  say("Regions", report.segmentation && regions(report.segmentation));
  say("Tree", report.tree && tree(report));
  say("Cells", report.cells && `${counted(report.cells.length, "cell")}, ${
    whole(report.cells.filter((cell: Json) => cell.mass === 0).length)} of them empty; their dual has ${
    counted(report.rdt.length, "triangle")}.`);
  say("Check", report.passed !== undefined && (report.passed ? "All cases agree with the CPU."
    : "Some cases do not agree with the CPU: do not compute on this device."));
  say("Device", report.device && device(report.device));
  say("Certainty", report.certification && certification(report.certification, report.command));
  say("Time", report.seconds && `${short(report.seconds.total)} seconds.`);
  return said;
}

// What matters most, in a line.
export function lead(report: Json): string {
  const parts: string[] = [];
  const mesh = report.output ?? report.input;
  if (mesh) parts.push(size(mesh));
  const q = report.quality;
  if (q?.dihedral_min !== undefined) parts.push(`dihedral angles from ${short(q.dihedral_min)}°`);
  else if (q?.theta_min !== undefined) parts.push(`angles from ${short(q.theta_min)}°`);
  if (q?.distance_rms !== undefined) parts.push(`${short(q.distance_rms)} % of the diagonal from the ${
    report.reference ? "reference" : "input"}`);
  const t = report.topology;
  if (t) parts.push(t.matches_input === false ? "topology NOT as the input" : t.manifold ? "manifold" : "not manifold");
  if (report.cells) parts.push(counted(report.cells.length, "cell"));
  if (report.segmentation) parts.push(counted(report.segmentation.regions.length, "region"));
  if (report.tree) parts.push(counted(report.tree.branches, "branch", "branches"));
  if (report.devices) parts.push(counted(report.devices.length, "device"));
  if (report.passed !== undefined) parts.push(report.passed ? "passed" : "FAILED");
  return parts.join(" · ");
}
