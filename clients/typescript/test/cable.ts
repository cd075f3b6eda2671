/** A cable between a client and a gateway, for tests that pull it out. */

import { connect, createServer, type AddressInfo, type Server, type Socket } from "node:net";

export class Cable {
  plugged = true;
  readonly #ends = new Set<Socket>();
  readonly #server: Server;

  private constructor(server: Server) {
    this.#server = server;
  }

  static async to(url: string): Promise<Cable> {
    const { hostname, port } = new URL(url);
    const server = createServer((client) => {
      if (!cable.plugged) {
        client.destroy();
        return;
      }
      const gateway = connect(Number(port), hostname);
      for (const end of [client, gateway]) {
        cable.#ends.add(end);
        end.on("error", () => undefined);
        end.on("close", () => cable.#ends.delete(end));
      }
      client.pipe(gateway);
      gateway.pipe(client);
    });
    const cable = new Cable(server);
    await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
    return cable;
  }

  get url(): string {
    return `http://127.0.0.1:${(this.#server.address() as AddressInfo).port}`;
  }

  /** Break every connection; new ones break at once until `plug`. */
  pull(): void {
    this.plugged = false;
    for (const end of this.#ends) end.destroy();
  }

  plug(): void {
    this.plugged = true;
  }

  close(): void {
    this.pull();
    this.#server.close();
  }
}
