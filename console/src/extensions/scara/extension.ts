/** SCARA robots, each made of bodies of a line. */

import type { Extension } from "../../extensions.ts";
import { gateway } from "../../gateway.ts";
import { PAGE, type Scara } from "./scara.ts";
import Page from "./Page.svelte";
import Pendant from "./Pendant.svelte";
import Tile from "./Tile.svelte";

export const extension: Extension = {
  page: PAGE,
  collection: "scaras",
  name: { en: "SCARA robot", ja: "スカラロボット" },
  read: async (): Promise<Scara[]> => {
    const { data } = await gateway.http.GET("/scaras");
    return (data?.scaras ?? []).map((it) => ({ ...it, page: PAGE, address: it.scara_id, members: it.axes.map(({ body_id }) => body_id) }));
  },
  readMove: async (scara_id, move_id) =>
    (await gateway.http.GET("/scaras/{scara_id}/moves/{move_id}", { params: { path: { scara_id, move_id } } })).data,
  Page,
  Tile,
  Pendant,
};
