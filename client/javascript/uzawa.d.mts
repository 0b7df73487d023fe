/** Types of uzawa.mjs. Those of requests and answers follow from the service's OpenAPI file: see README.md. */
export type Status = "accepted" | "running" | "successful" | "failed" | "dismissed";

export interface Job {
  id: string;
  status: Status;
  progress: number;
  /** Once there is an answer; outcome is "converged" where it is certified as asked. */
  summary: (Record<string, any> & { outcome: string }) | null;
  error: Problem | null;
  [name: string]: any;
}

/** RFC 9457. */
export interface Problem {
  status?: number;
  code?: string;
  detail?: string;
  /** JSON pointer into the request. */
  pointer?: string;
  [name: string]: any;
}

export type Result = Record<string, any>;
export type Query = Record<string, string>;
export type Progress = (data: Record<string, any>) => void;

export class Refused extends Error {
  problem: Problem;
}

export class Uzawa {
  constructor(server?: string, options?: { token?: string; patience?: number });
  solve(request: object, progress?: Progress): Promise<Job>;
  submit(request: object, wait?: number): Promise<Job>;
  validate(request: object): Promise<Record<string, any>>;
  job(id: string): Promise<Job>;
  jobs(query?: Query): Promise<Job[]>;
  wait(id: string, progress?: Progress): Promise<Job>;
  result(id: string, fields?: string[], name?: string): Promise<Result>;
  history(id: string, name?: string): Promise<Record<string, (number | null)[]>>;
  picture(id: string, kind?: "deformed" | "convergence" | "whole-error", query?: Query): Promise<string>;
  dismiss(id: string): Promise<void>;
  upload(data: string | ArrayBuffer | Uint8Array): Promise<{ upload: string }>;
  verify(request: object): Promise<Result>;
  events(id: string): AsyncGenerator<[string, Record<string, any>]>;
  open(method: string, path: string, body?: object, headers?: Record<string, string>): Promise<Response>;
}
