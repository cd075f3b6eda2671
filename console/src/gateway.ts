/** The gateway that has served this page, in the language of the page. */

import { GatewayError } from "../../clients/typescript/src/errors.ts";
import { Gateway } from "../../clients/typescript/src/gateway.ts";
import type { Schemas } from "../../clients/typescript/src/types.ts";
import { replay } from "./replay.svelte.ts";
import { language } from "./words/index.svelte.ts";

export { GatewayError, NoAnswer, Refused } from "../../clients/typescript/src/errors.ts";
export type * from "../../clients/typescript/src/types.ts";

export type Body = Schemas["BodyInfo"];
export type Group = Schemas["GroupInfo"];
export type Identity = Schemas["Identity"];
export type Line = Schemas["LineInfo"] | Schemas["RobotLineInfo"];
export type Robot = Schemas["RobotInfo"];
export type Unit = Schemas["UnitInfo"];
/** A thing that an extension makes of bodies. */
export interface Made extends Pick<Body, "line_id" | "name" | "online" | "moving" | "homed" | "power_cycled" | "move_id"> {
  address: string;
  /** The page of its extension. */
  page: string;
  group_id: string;
  /** The bodies that it is made of. */
  members: readonly string[];
}
type MadeMove = Omit<Schemas["RobotMove"], "kind" | "robot_id" | "unit" | "units" | "coordinates" | "position" | "start_position" | "target_position" | "longest_s" | "completion"> & {
  kind: string;
  start: unknown;
  target: unknown;
};
export type AnyMove = Schemas["Move"] | Schemas["RobotMove"] | MadeMove;
/** What one steps up to and moves. */
export type Target = Body | Robot | Made;
/** Where the axes of a unit are, by their names. */
export type Axes = Schemas["RobotPosition"]["axes"];
export type Right = Identity["rights"][number];

/** Where the gateway is, behind a proxy at a sub-path too; without a slash at its end. */
export const address = new URL(".", location.href).href.slice(0, -1);

const TIMEOUT_S = 5;
/** A backup of a full line takes minutes. */
const LONGEST_S = 1800;

const PROOF = `motion-gateway.proof.${address}`;

/** The second secret of the session. Browsers send its cookie to every port of our host; this only we read. */
function proof(): string | null {
  return localStorage.getItem(PROOF);
}

/** Take the second secret of a session that has just begun, by what the sign-in has put into the address. */
export async function claimProof(): Promise<void> {
  const here = new URL(location.href);
  const claim = here.searchParams.get("claim");
  if (!claim) return;
  here.searchParams.delete("claim");
  history.replaceState(null, "", here);
  const answer = await fetch(`${address}/sign-in/${encodeURIComponent(claim)}`, { method: "POST" });
  if (answer.ok) localStorage.setItem(PROOF, ((await answer.json()) as { proof: string }).proof);
}

/** Add to the query of a stream what opens it: a browser sends no header with it. */
export async function admitted(query: Record<string, string>): Promise<Record<string, string>> {
  if (proof() === null) return query;
  const { data } = await gateway.http.POST("/tickets");
  return data ? { ...query, ticket: data.ticket } : query;
}

/** What is sent along with everything that is more than a reading. */
export const sent = new Headers();

/** Since when the owner of a line with a spare has it, by the address of the line or of a robot there. */
export const epochs = new Map<string, number>();

/** The epoch that this page has shown of what a request is for: a gateway that has taken the line over refuses it. */
function epochOf(url: string): number | undefined {
  const [, of = ""] = /^\/\w+\/([^/?]+)/.exec(url.slice(address.length)) ?? [];
  return epochs.get(decodeURIComponent(of)) ?? epochs.get(of.split(".")[0] ?? "");
}

function speaking(request: Request): Request {
  request.headers.set("Accept-Language", language.now);
  const shown = proof();
  if (shown !== null) request.headers.set("Session-Proof", shown);
  if (request.method === "GET") return request;
  sent.forEach((value, name) => request.headers.set(name, value));
  const epoch = epochOf(request.url);
  if (epoch !== undefined) request.headers.set("Owner-Epoch", `${epoch}`);
  return request;
}

const REQUEST_ID = "X-Request-Id";
/** The newest requests of this page that changed anything. */
const own = new Set<string>();
const MOST_OWN = 1000;

/** Whether this page has asked for it. */
export function isOwn(request_id: string | null): boolean {
  return request_id !== null && own.has(request_id);
}

async function fetchNoting(request: Request): Promise<Response> {
  const answer = await fetch(speaking(request));
  replay.note(answer);
  const id = request.method === "GET" ? null : answer.headers.get(REQUEST_ID);
  if (id) own.add(id);
  for (const oldest of own) if (own.size > MOST_OWN) own.delete(oldest);
  return answer;
}

function gatewayWithin(timeout: number): Gateway {
  return new Gateway({ url: address, key: "", timeout, fetch: (request) => fetchNoting(request as Request) });
}

/** For what a page shows. */
export const gateway = gatewayWithin(TIMEOUT_S);
/** For what somebody has asked for. */
export const patient = gatewayWithin(LONGEST_S);

/** Something that the gateway is asked for. */
export type Deed = (gateway: Gateway) => Promise<unknown>;

/** Read what a page shows. Where that fails the banner, or an alarm, says why. */
export async function quietly(read: () => Promise<unknown>): Promise<void> {
  try {
    await read();
  } catch (error) {
    if (!(error instanceof GatewayError)) throw error;
  }
}

type Download = (path: string, options: object) => Promise<{ data?: Blob }>;

/** Download the file of a recording, which the OpenAPI document does not have. */
export async function contentOf({ http }: Gateway, recording_id: string): Promise<Blob | undefined> {
  const download = http.GET as unknown as Download;
  return (await download("/recordings/{recording_id}/content", { params: { path: { recording_id } }, parseAs: "blob" })).data;
}

/** Write the request of a deed as a command line. Nothing is sent, and the deed never gets an answer to go on with. */
export function curlOf(deed: Deed, withKey: boolean): Promise<string> {
  return new Promise((write) => {
    const fetch = async (request: unknown): Promise<Response> => {
      write(await commandLine(request as Request, withKey));
      return new Promise(() => undefined);
    };
    void deed(new Gateway({ url: address, key: "", fetch }));
  });
}

async function commandLine(request: Request, withKey: boolean): Promise<string> {
  const body = await request.text();
  const parts = ["curl", "-X", request.method, quoted(request.url)];
  if (withKey) parts.push("-H", '"Authorization: Bearer $MOTION_GATEWAY_KEY"');
  if (body) parts.push("-H", quoted("Content-Type: application/json"), "-d", quoted(body));
  return parts.join(" ");
}

function quoted(text: string): string {
  return `'${text.replaceAll("'", String.raw`'\''`)}'`;
}
