/**
 * Annotation: the plan of a dataset in the inspector, with its keys.
 *
 * The room imports `widgets`, `inspector`, and types of `model` and `panes`.
 */

import { annotationBindings } from "./annotation_keys.js";
import { makeReview } from "./review.js";
import { annotationSection } from "./section.js";
import { makeVisits } from "./visits.js";

/** @typedef {ReturnType<typeof mount>} AnnotationRoom */

/**
 * Add the section to the inspector.
 *
 * @param {import("../model/index.js").Context} context
 * @param {{panes: import("../panes/index.js").Panes, inspector: import("../inspector/index.js").InspectorRoom}} rooms
 */
export function mount(context, { panes, inspector: { inspector } }) {
  const visits = makeVisits(context, panes);
  const review = makeReview(context, visits);
  const section = annotationSection(context, review, visits);
  inspector.add(section, "calibration");
  return { bindings: annotationBindings(section, review, (row) => inspector.reveal("annotation", row)) };
}
