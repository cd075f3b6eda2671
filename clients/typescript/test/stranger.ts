/** What a stranger writes against a client that another generator has made with its plain defaults: it compiles. */

import { listEvents, getPosition, startMove } from "./made";

const { data: move } = await startMove({
  path: { body_id: "3F" },
  body: { kind: "relative", direction: "cw", distance: { value: 5, unit: "pulse" } },
});
const { data: position } = await getPosition({ path: { body_id: "3F" } });
const { data: page } = await listEvents();
for (const event of page?.events ?? []) {
  if (event.type === "line.down") console.log(event.data.reason, move, position?.pulses);
}
